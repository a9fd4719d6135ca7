"""Plan, job and the station that carries them out."""
