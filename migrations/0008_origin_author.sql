-- Why: who publishes a catalogue is to be credited wherever an entry of it goes, and a title names nobody.
--
-- Of what was imported before nobody noted the authors: no rows.

-- Who answers for the catalogue that a revision was taken from, in their order.
CREATE TABLE origin_author (
    revision_id INTEGER NOT NULL REFERENCES origin (revision_id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    author      TEXT    NOT NULL CHECK (length(author) >= 1),       -- "Family, Given"
    PRIMARY KEY (revision_id, position)
) STRICT, WITHOUT ROWID;
