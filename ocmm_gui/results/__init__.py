"""The results of a job: all characteristics, why each is as uncertain as it is, and the reports."""
