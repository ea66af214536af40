"""Diagnosis: where a measured record and the model disagree, which effect is missing, and what cannot be known.

    preprocessing -> forward -> random_effects -> estimation -> inference -> report

`pipeline` runs them in this order for one record; `api` is the way in (`diagnose_record`), `result` what comes out,
`examined` that with everything behind it; `shared_exponent` fits one power law to several records.
"""

from .api import diagnose_record, diagnose_records
from .result import Diagnosis, Gap, NamedEffect, Place, Value

__all__ = ["Diagnosis", "Gap", "NamedEffect", "Place", "Value", "diagnose_record", "diagnose_records"]
