-- Why: which of a hundred thousand materials a curve is nearest to is asked of all of them. What scenes
-- render of each stands here in outline, so that few must be looked at in full. And what came from
-- somebody else's catalogue keeps from which, and when it was made there.
--
-- The program fills the outlines of what was stored before; where that came from nobody knows: no row.

-- Somebody else's catalogue that a revision was taken from.
CREATE TABLE origin (
    revision_id     INTEGER PRIMARY KEY REFERENCES activity (revision_id) ON DELETE CASCADE,
    title           TEXT,                                           -- NULL: a database by itself
    version         TEXT,
    doi             TEXT,
    url             TEXT,
    revision        INTEGER NOT NULL CHECK (revision >= 1),         -- its number there
    added_at        TEXT    NOT NULL CHECK (added_at GLOB '????-??-??T??:??:??Z'), -- there, UTC
    program_version TEXT    NOT NULL,
    command         TEXT                                            -- what made it there
) STRICT;

-- Made of the current revision in the transaction that makes a revision current, as `entry` is. What its
-- bytes say is in src/brdf/outline.rs; they stand for nothing that is not stored elsewhere, and exports
-- leave them out.
CREATE TABLE outline (
    slug          TEXT PRIMARY KEY REFERENCES entry (slug) ON DELETE CASCADE,
    theta_min_rad REAL NOT NULL,
    theta_max_rad REAL NOT NULL,
    model_hash    BLOB CHECK (length(model_hash) = 16),             -- NULL: nothing can be rendered
    levels        BLOB CHECK (length(levels) = 180)                 -- NULL: not known
) STRICT, WITHOUT ROWID;
