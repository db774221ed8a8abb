"""A torque-level telescope axis with known faults: the truth of blind checks.

Nothing here shares a line with the models that it is to check: the differential equations of motor, gear,
load and structure are integrated at 1 kHz or finer. Only blind checks and studies import it.
"""
