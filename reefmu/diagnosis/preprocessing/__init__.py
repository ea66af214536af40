"""Preprocessing of a record: `audit` (what it allows), `trace` (signals and blocks), `motion` (paths and speeds without
the noise of the angles), `noise` and `autocorrelation` (size and correlation of the noise, without a model),
`thinning` (fewer samples of a long record, on which sets of effects are ranked)."""
