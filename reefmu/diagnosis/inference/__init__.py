"""What is asked of a record beside its fits.

* `isolability`: what this excitation shows.
* `exchanges`: sets that a record hardly tells from another.
* `simulated_records`: without effects, along this one; `dispersion`: by how much gains exceed what the covariance
  expects, there and here.
* `nonparametric`: terms without a name; `tolerance_curve`: which of them tolerances make.
* `evidence`: what a conclusion is drawn from.
"""
