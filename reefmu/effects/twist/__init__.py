"""Effects on the twist of the contacts: kinematic error, and compliances in series with the contacts."""
