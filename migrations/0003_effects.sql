-- Why: what a scattering model alone does not explain of a material, a physical effect does. A
-- revision keeps its effects with their parameters, so that whatever renders it uses them, too.
--
-- Whatever was stored before has none: no rows.

CREATE TABLE effect (
    revision_id INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    name        TEXT    NOT NULL CHECK (length(name) >= 1),
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, name)
) STRICT, WITHOUT ROWID;

-- Parameters that are not listed have the value at which the effect is absent.
CREATE TABLE effect_parameter (
    revision_id INTEGER NOT NULL,
    effect      TEXT    NOT NULL,
    name        TEXT    NOT NULL,
    value       REAL    NOT NULL,                                   -- in the unit that ends `name`
    PRIMARY KEY (revision_id, effect, name),
    FOREIGN KEY (revision_id, effect) REFERENCES effect (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;
