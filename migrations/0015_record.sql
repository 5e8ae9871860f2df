-- Why: the hash of the content does not cover when, by which program and from what a revision was made, nor its number.
-- Damage there was shown as if it had been stored. A table of its own: a column would make SQLite check every row of
-- `revision`, and a file with a damaged one could not be opened.

-- BLAKE3 of the parts of a revision's record. NULL: damaged when it would have been computed.
CREATE TABLE record (
    revision_id  INTEGER PRIMARY KEY REFERENCES revision (id) ON DELETE CASCADE,
    number_hash  TEXT CHECK (length(number_hash) = 64),             -- name, number and content hash
    date_hash    TEXT CHECK (length(date_hash) = 64),               -- date and program version
    command_hash TEXT CHECK (length(command_hash) = 64),            -- command and its inputs
    origin_hash  TEXT CHECK (length(origin_hash) = 64)              -- catalogue it was imported from
) STRICT;
