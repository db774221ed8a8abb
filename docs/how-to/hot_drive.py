"""An effect of another package."""

from bayes_hw.gap.effects.descriptions import Description
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.priors import positive, signed
from bayes_hw.gap.simulate import settings as S  # noqa: N812


class HotDrive(Effect):
    """v (1 + change (1 - exp(-t / time))) and y + push (1 - exp(-t / time)): the drive warms up.

    Its gain changes, and the encoder beside it is pushed aside, in one time. Not to be believed where time is
    much longer than the record.
    """

    label, block = "hot_drive", "input"
    test_values, vanishing_values = (0.05, 0.02, 30.0), (0.0, 0.0, 30.0)
    description = Description(
        "Hot drive",
        "the drive warms up, and pushes the encoder beside it aside",
        "The same command moves the axis faster later on; the angle has moved where nothing was commanded.",
        {"gain_drift": "A drifting gain leaves the angle at rest alone."},
        "Warm up before measuring, or move the encoder.",
    )

    def parameters(self, scale):
        """Change of the gain, push of the encoder, their common time."""
        return (
            signed("hot_drive.gain_change", "", 0.1),
            signed("hot_drive.push", scale.units.output, 20 * scale.sigma),
            positive("hot_drive.time", "s", 0.3 * scale.duration, 0.8),
        )

    def apply(self, values, settings, scale):
        """The gain's drift and the sensor's, together."""
        change, push, time = values
        settings[S.GAIN_CHANGE], settings[S.GAIN_TIME] = change, time
        settings[S.DRIFT_SETTLING], settings[S.DRIFT_TIME] = push, time

    def starts(self, scale):
        """Three times."""
        return [(0.01, scale.sigma, share * scale.duration) for share in (0.07, 0.2, 0.5)]
