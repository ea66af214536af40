"""What is asked of a record beside its fits.

* `isolability`: what this excitation shows.
* `exchanges`: sets that a record hardly tells from another.
* `simulated_records`: without effects, along this one, and what gains there by chance; `dispersion`: by how much this
  one deviates more than the covariance says.
* `nonparametric`: terms without a name; `law_errors`: which of them errors of laws make; `unnamed`: these terms, what
  exceeds noise and tolerances, and effects beside both; `tolerance_curve`: how far tolerances let a curve be off.
* `evidence`: what a conclusion is drawn from.
"""
