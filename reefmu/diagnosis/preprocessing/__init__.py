"""A record made ready: `audit` (what it allows), `motion` and `trace` (paths and speeds without the angles' noise),
`noise` with `autocorrelation` (its size, model-free)."""
