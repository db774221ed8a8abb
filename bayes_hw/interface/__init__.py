"""The Python interface: the three questions as functions, their answers as objects that show themselves.

Top of the stream: it puts results and figures together and computes nothing of its own.
"""
