"""Commands that plan tests: plan."""
