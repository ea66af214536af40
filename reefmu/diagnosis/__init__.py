"""Diagnosis: where a measured record and the model disagree, which effect is missing, and what cannot be known.

    audit -> noise -> scatter -> isolability -> search over sets of effects -> acceptance -> verdict -> report

`diagnose_record` is the way in.
"""

from .entry import diagnose_record, diagnose_records
from .result import Diagnosis, Gap, NamedEffect, Place, Value

__all__ = ["Diagnosis", "Gap", "NamedEffect", "Place", "Value", "diagnose_record", "diagnose_records"]
