-- Why: the hash of the content does not cover when, by which program and from what a revision was made, nor its number.
-- Damage there was shown as if it had been stored.

-- BLAKE3 of name, number, content hash, date, program version, and command with its inputs and origin.
-- NULL: damaged when it would have been computed.
ALTER TABLE revision ADD COLUMN record_hash TEXT CHECK (length(record_hash) = 64);
