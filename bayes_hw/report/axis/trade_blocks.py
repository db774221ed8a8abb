"""What trades places with the dead zone, as the pages of a posterior and of identifiability say it."""

from __future__ import annotations

from bayes_hw.infer.dead_zone_trade import Trade
from bayes_hw.report.page.document import Paragraph, Table
from bayes_hw.report.page.rounding import format_number, format_percent
from bayes_hw.report.page.typography import typeset


def trade_blocks(trade: Trade) -> tuple[Paragraph, Table]:
    """What trades places with the dead zone, in words and numbers."""
    return (
        Paragraph(typeset(trade.sentence[:1].upper() + trade.sentence[1:] + ".")),
        Table(
            ("known", "standard deviation of the half width", "share of its variance"),
            (
                ("nothing", format_number(trade.sd, 2, trade.unit), ""),
                *(
                    (group, format_number(sd, 2, trade.unit), format_percent(trade.share(group)))
                    for group, sd in trade.sd_known.items()
                ),
            ),
            "What would be left of the dead zone's uncertainty were other parameters known, from the "
            "covariance of the draws in coordinates. Shares overlap where groups are correlated.",
            (1, 2),
        ),
    )
