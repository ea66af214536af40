"""Diagnosis: where a measured record and the model disagree, which effect is missing, and what cannot be known.

    preprocessing -> forward -> random_effects -> estimation -> inference -> report

`pipeline` runs them in this order for one record; `api` is the way in (`diagnose_record`), `schema` what comes out,
`analysis` that with everything behind it; `shared_exponent` fits one power law to several records.
"""

from .api import diagnose_record, diagnose_records
from .schema import Diagnosis, Gap, Location, NamedEffect, Value

__all__ = ["Diagnosis", "Gap", "Location", "NamedEffect", "Value", "diagnose_record", "diagnose_records"]
