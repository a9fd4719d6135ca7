CREATE INDEX job_by_arrival ON job (station, received_utc);
