"""What records show before any model: measures of the motion, the response, the noise and the command.

Everything here takes records and gives numbers; the page is made of them in bayes_hw.report.look.
"""
