ALTER TABLE job ADD COLUMN requirements {text} NOT NULL DEFAULT '';
