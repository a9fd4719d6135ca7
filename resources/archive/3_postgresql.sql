-- Numbers of an outbox belong to the login that uses it, versions of a job to their station.
ALTER TABLE job DROP CONSTRAINT job_job_uuid_steps_head_sound_key, ADD UNIQUE (job_uuid, station, steps, head, sound), ADD COLUMN key {text} NOT NULL DEFAULT '', ADD COLUMN signature {text} NOT NULL DEFAULT '';
ALTER TABLE delivery DROP CONSTRAINT delivery_outbox_fkey, DROP CONSTRAINT delivery_pkey, ADD COLUMN signature {text} NOT NULL DEFAULT '';
ALTER TABLE sender DROP CONSTRAINT sender_pkey, ADD PRIMARY KEY (outbox, role);
INSERT INTO sender (outbox, station, machine, username, role)
        SELECT DISTINCT d.outbox, s.station, s.machine, s.username, d.role
        FROM delivery d JOIN sender s ON s.outbox = d.outbox WHERE d.role <> s.role;
ALTER TABLE delivery ADD PRIMARY KEY (outbox, role, sequence), ADD FOREIGN KEY (outbox, role) REFERENCES sender (outbox, role);
