"""Diagnosis: where a measured record and the model disagree, which effect is missing, and what the record cannot show.

    preprocessing -> forward -> random_effects -> estimation -> inference -> probabilities -> report

`pipeline` runs them in this order for one record, on the problem that `preparation` sets up; `discrimination` says
what such a record tells apart, also before it is measured, and `losses` finds friction at the crank where a record
holds the torques of both ends. `api` has the public functions (`diagnose_record`), `schema`, `fitted_values` and
`hypotheses` what they return, `analysis` that together with the evidence behind it. `amplitude_agreement` compares
sizes in small and large cycles; `shared_exponent` fits one power law to several records.
"""

from .api import diagnose_record, diagnose_records
from .fitted_values import NamedEffect, Value
from .hypotheses import Hypothesis, IsolabilityMatrix
from .probabilities.priors import Priors, load_priors
from .schema import Diagnosis, Gap, Location

__all__ = [
    "Diagnosis",
    "Gap",
    "Hypothesis",
    "IsolabilityMatrix",
    "Location",
    "NamedEffect",
    "Priors",
    "Value",
    "diagnose_record",
    "diagnose_records",
    "load_priors",
]
