-- Why: the first schema. It keeps every revision of a material with where each number comes from,
-- so that what was once rendered can be looked up; a change never overwrites anything.
--
-- SI and linear: hertz, radians, σ⁰ as a ratio. A column's name carries its unit.
-- `position` is the order in which the material lists its rows, from 0.
-- The CHECKs repeat what a material must fulfil, so that no other program can break it from outside.

-- "matd": tells our files from other programs'.
PRAGMA application_id = 0x6d617464;

CREATE TABLE material (
    id               INTEGER PRIMARY KEY,
    slug             TEXT    NOT NULL UNIQUE
        CHECK (length(slug) BETWEEN 1 AND 64 AND slug NOT GLOB '*[^a-z0-9-]*'),
    current_revision INTEGER NOT NULL,
    FOREIGN KEY (id, current_revision) REFERENCES revision (material_id, number)
        DEFERRABLE INITIALLY DEFERRED
) STRICT;

CREATE TABLE revision (
    id               INTEGER PRIMARY KEY,
    material_id      INTEGER NOT NULL REFERENCES material (id) ON DELETE CASCADE,
    number           INTEGER NOT NULL CHECK (number >= 1),
    content_hash     TEXT    NOT NULL CHECK (length(content_hash) = 64),
    name             TEXT    NOT NULL,
    class            TEXT    NOT NULL,
    description      TEXT    NOT NULL,
    licence          TEXT    NOT NULL,                              -- SPDX identifier
    tags             TEXT    NOT NULL CHECK (json_type(tags) = 'array'),
    frequency_min_hz REAL    NOT NULL CHECK (frequency_min_hz > 0),
    frequency_max_hz REAL    NOT NULL CHECK (frequency_max_hz >= frequency_min_hz),
    theta_min_rad    REAL    NOT NULL CHECK (theta_min_rad >= 0),
    theta_max_rad    REAL    NOT NULL
        CHECK (theta_max_rad BETWEEN theta_min_rad AND 1.5707963267948966),
    render           TEXT    NOT NULL,                              -- a fit's or a curve's name
    added_at         TEXT    NOT NULL CHECK (added_at GLOB '????-??-??T??:??:??Z'), -- UTC
    program_version  TEXT    NOT NULL,
    UNIQUE (material_id, number)
) STRICT;

CREATE TABLE source (
    revision_id INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    key         TEXT    NOT NULL,
    kind        TEXT    NOT NULL
        CHECK (kind IN ('measured', 'literature', 'modelled', 'synthetic')),
    title       TEXT    NOT NULL,
    doi         TEXT,
    url         TEXT,
    licence     TEXT,
    note        TEXT,
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, key)
) STRICT, WITHOUT ROWID;

CREATE TABLE instrument (
    revision_id         INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position            INTEGER NOT NULL,
    key                 TEXT    NOT NULL,
    name                TEXT    NOT NULL,
    centre_frequency_hz REAL    NOT NULL CHECK (centre_frequency_hz > 0),
    bandwidth_hz        REAL    CHECK (bandwidth_hz > 0),
    polarisation        TEXT,
    note                TEXT,
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, key)
) STRICT, WITHOUT ROWID;

CREATE TABLE curve (
    revision_id INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    name        TEXT    NOT NULL,
    source      TEXT    NOT NULL,
    instrument  TEXT,
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, name),
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key),
    FOREIGN KEY (revision_id, instrument) REFERENCES instrument (revision_id, key)
) STRICT, WITHOUT ROWID;

CREATE TABLE observation (
    revision_id      INTEGER NOT NULL,
    curve            TEXT    NOT NULL,
    position         INTEGER NOT NULL,
    theta_i_rad      REAL    NOT NULL CHECK (theta_i_rad BETWEEN 0 AND 1.5707963267948966),
    theta_r_rad      REAL    NOT NULL CHECK (theta_r_rad BETWEEN 0 AND 1.5707963267948966),
    delta_phi_rad    REAL    NOT NULL,
    sigma0           REAL    CHECK (sigma0 > 0),
    censor           TEXT    NOT NULL CHECK (censor IN ('none', 'left', 'right')),
    threshold_sigma0 REAL    CHECK (threshold_sigma0 > 0),
    PRIMARY KEY (revision_id, curve, position),
    FOREIGN KEY (revision_id, curve) REFERENCES curve (revision_id, name) ON DELETE CASCADE,
    CHECK ((sigma0 IS NULL) = (censor <> 'none')),
    CHECK (censor = 'none' OR threshold_sigma0 IS NOT NULL)
) STRICT, WITHOUT ROWID;

CREATE TABLE fit (
    revision_id INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    name        TEXT    NOT NULL,
    model       TEXT    NOT NULL CHECK (json_type(model) = 'object'), -- values: fit_parameter
    estimator   TEXT    NOT NULL,
    curve       TEXT,
    source      TEXT    NOT NULL,
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, name),
    FOREIGN KEY (revision_id, curve) REFERENCES curve (revision_id, name),
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key)
) STRICT, WITHOUT ROWID;

CREATE TABLE fit_parameter (
    revision_id INTEGER NOT NULL,
    fit         TEXT    NOT NULL,
    position    INTEGER NOT NULL,
    path        TEXT    NOT NULL,
    value       REAL    NOT NULL,                                   -- in `unit`
    unit        TEXT    NOT NULL,                                   -- UCUM code
    sd          REAL    CHECK (sd >= 0),                            -- in `unit`; NULL: not known
    source      TEXT,                                               -- NULL: the fit's
    PRIMARY KEY (revision_id, fit, position),
    UNIQUE (revision_id, fit, path),
    FOREIGN KEY (revision_id, fit) REFERENCES fit (revision_id, name) ON DELETE CASCADE,
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key)
) STRICT, WITHOUT ROWID;

-- The whole symmetric matrix, row by row.
CREATE TABLE fit_covariance (
    revision_id INTEGER NOT NULL,
    fit         TEXT    NOT NULL,
    position    INTEGER NOT NULL,
    row_path    TEXT    NOT NULL,
    column_path TEXT    NOT NULL,
    covariance  REAL    NOT NULL,                                   -- in the two units' product
    PRIMARY KEY (revision_id, fit, position),
    UNIQUE (revision_id, fit, row_path, column_path),
    FOREIGN KEY (revision_id, fit, row_path)
        REFERENCES fit_parameter (revision_id, fit, path) ON DELETE CASCADE,
    FOREIGN KEY (revision_id, fit, column_path)
        REFERENCES fit_parameter (revision_id, fit, path) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;
