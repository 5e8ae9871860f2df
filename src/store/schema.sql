-- The latest schema in one piece, written by a test: see `LATEST_SCHEMA` in connect.rs. Change
-- migrations/ instead.

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
    program_version  TEXT    NOT NULL, status TEXT NOT NULL DEFAULT 'active'
    CHECK (status IN ('active', 'superseded', 'withdrawn')), status_reason TEXT
    CHECK ((status_reason IS NULL) = (status = 'active')), superseded_by TEXT
    CHECK ((superseded_by IS NOT NULL) = (status = 'superseded')), finish TEXT, unknown TEXT NOT NULL DEFAULT '[]'
    CHECK (json_type(unknown) = 'array'),
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
    note        TEXT, authors TEXT NOT NULL DEFAULT '[]'
    CHECK (json_type(authors) = 'array'), year INTEGER CHECK (year BETWEEN 1000 AND 9999), container TEXT, volume TEXT, pages TEXT, publisher TEXT, making TEXT
    CHECK (making IN ('own-measurement', 'copied', 'digitised', 'computed')),
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
    note                TEXT, transmit_polarisation TEXT, receive_polarisation TEXT, geometry TEXT CHECK (geometry IN ('monostatic', 'bistatic')), stand_off_m REAL CHECK (stand_off_m > 0), spot_diameter_m REAL CHECK (spot_diameter_m > 0), aperture_m REAL CHECK (aperture_m > 0), calibration_target TEXT, calibration_sd_factor REAL CHECK (calibration_sd_factor >= 1), scale TEXT CHECK (scale IN ('absolute', 'relative')), noise_floor_w REAL CHECK (noise_floor_w > 0), threshold_w REAL CHECK (threshold_w > 0), false_alarm_probability REAL
    CHECK (false_alarm_probability > 0 AND false_alarm_probability < 1), range_bins INTEGER CHECK (range_bins BETWEEN 1 AND 4294967295), looks REAL CHECK (looks > 0), looks_method TEXT,
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
    threshold_sigma0 REAL    CHECK (threshold_sigma0 > 0), theta_sd_rad REAL
    CHECK (theta_sd_rad BETWEEN 0 AND 1.5707963267948966), power_w REAL CHECK (power_w > 0), range_m REAL CHECK (range_m >= 0), chirp INTEGER CHECK (chirp BETWEEN 0 AND 4294967295), xt_m REAL, yt_m REAL CHECK ((yt_m IS NULL) = (xt_m IS NULL)),
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
    source      TEXT    NOT NULL, report TEXT CHECK (json_type(report) = 'object'),
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

CREATE TABLE roughness (
    revision_id          INTEGER PRIMARY KEY REFERENCES revision (id) ON DELETE CASCADE,
    rms_height_m         REAL    NOT NULL CHECK (rms_height_m >= 0),
    correlation_length_m REAL    CHECK (correlation_length_m > 0),
    method               TEXT,
    source               TEXT    NOT NULL,
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key)
) STRICT;

CREATE TABLE session (
    revision_id        INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position           INTEGER NOT NULL,
    key                TEXT    NOT NULL,
    date               TEXT    NOT NULL CHECK (date IS date(date)),
    temperature_k      REAL    CHECK (temperature_k > 0),
    relative_humidity  REAL    CHECK (relative_humidity BETWEEN 0 AND 1),
    cloud_hash         TEXT    CHECK (length(cloud_hash) = 64),
    mesh_hash          TEXT    CHECK (length(mesh_hash) = 64),
    registration_rms_m REAL    CHECK (registration_rms_m >= 0),
    normal_sd_rad      REAL    CHECK (normal_sd_rad BETWEEN 0 AND 1.5707963267948966),
    footprint_sd_rad   REAL    CHECK (footprint_sd_rad BETWEEN 0 AND 1.5707963267948966),
    pose               TEXT    CHECK (json_type(pose) = 'object'),
    note               TEXT,
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, key)
) STRICT, WITHOUT ROWID;

CREATE TABLE curve_session (
    revision_id INTEGER NOT NULL,
    curve       TEXT    NOT NULL,
    session     TEXT    NOT NULL,
    PRIMARY KEY (revision_id, curve),
    FOREIGN KEY (revision_id, curve) REFERENCES curve (revision_id, name) ON DELETE CASCADE,
    FOREIGN KEY (revision_id, session) REFERENCES session (revision_id, key) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE TABLE curve_statistic (
    revision_id      INTEGER NOT NULL,
    curve            TEXT    NOT NULL,
    position         INTEGER NOT NULL,
    theta_min_rad    REAL    NOT NULL CHECK (theta_min_rad >= 0),
    theta_max_rad    REAL    NOT NULL CHECK (theta_max_rad >= theta_min_rad),
    points           INTEGER NOT NULL CHECK (points >= 1),
    censored_points  INTEGER NOT NULL CHECK (censored_points BETWEEN 0 AND points),
    threshold_sigma0 REAL    CHECK (threshold_sigma0 > 0),
    mean_least       REAL    NOT NULL CHECK (mean_least >= 0),
    mean_greatest    REAL    NOT NULL CHECK (mean_greatest >= mean_least),
    quantile_05      REAL    CHECK (quantile_05 > 0),
    quantile_50      REAL    CHECK (quantile_50 > 0),
    quantile_95      REAL    CHECK (quantile_95 > 0),
    interval_low     REAL    CHECK (interval_low >= 0),
    interval_high    REAL    CHECK (interval_high >= interval_low),
    PRIMARY KEY (revision_id, curve, position),
    FOREIGN KEY (revision_id, curve) REFERENCES curve (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE TABLE finding (
    revision_id         INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position            INTEGER NOT NULL,
    effect              TEXT    NOT NULL CHECK (length(effect) >= 1),
    verdict             TEXT    NOT NULL
        CHECK (verdict IN ('found', 'not-found', 'unexplained')),
    fit_before          TEXT,
    fit_after           TEXT,
    gain                REAL,                                       -- in ln likelihood
    placebo_gain        REAL,                                       -- in ln likelihood
    p                   REAL    CHECK (p BETWEEN 0 AND 1),
    score_difference    REAL,                                       -- in ln p of held-out data
    score_difference_sd REAL    CHECK (score_difference_sd >= 0),
    size_db             REAL    CHECK (size_db >= 0),
    rms_before_db       REAL    CHECK (rms_before_db >= 0),
    rms_after_db        REAL    CHECK (rms_after_db >= 0),
    confusable_with     TEXT    NOT NULL CHECK (json_type(confusable_with) = 'array'),
    source              TEXT    NOT NULL,
    PRIMARY KEY (revision_id, position),
    FOREIGN KEY (revision_id, fit_before) REFERENCES fit (revision_id, name),
    FOREIGN KEY (revision_id, fit_after) REFERENCES fit (revision_id, name),
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key)
) STRICT, WITHOUT ROWID;

CREATE TABLE activity (
    revision_id INTEGER PRIMARY KEY REFERENCES revision (id) ON DELETE CASCADE,
    command     TEXT    NOT NULL CHECK (length(command) >= 1)
) STRICT;

CREATE TABLE activity_input (
    revision_id INTEGER NOT NULL REFERENCES activity (revision_id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    name        TEXT    NOT NULL,                                   -- of a file, without its folder
    hash        TEXT    NOT NULL CHECK (length(hash) = 64),         -- BLAKE3 of its bytes
    PRIMARY KEY (revision_id, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE unit (
    column_name TEXT PRIMARY KEY,
    ucum        TEXT,                                               -- NULL: the row says which
    meaning     TEXT NOT NULL
) STRICT, WITHOUT ROWID;

CREATE VIEW v_materials AS
SELECT slug, number AS revision, name, class, status, status_reason, superseded_by, licence,
    frequency_min_hz / 1e9 AS frequency_min_ghz, frequency_max_hz / 1e9 AS frequency_max_ghz,
    theta_min_rad * 57.29577951308232 AS theta_min_deg, theta_max_rad * 57.29577951308232 AS theta_max_deg,
    render, description
FROM material JOIN revision ON material_id = material.id AND number = current_revision;

CREATE TABLE entry (
    slug             TEXT    PRIMARY KEY,
    material_id      INTEGER NOT NULL UNIQUE REFERENCES material (id) ON DELETE CASCADE,
    revision         INTEGER NOT NULL,
    name             TEXT    NOT NULL,
    class            TEXT    NOT NULL,
    status           TEXT    NOT NULL,
    kind             TEXT,                                          -- of what scenes render
    frequency_min_hz REAL    NOT NULL,
    frequency_max_hz REAL    NOT NULL,
    curves           INTEGER NOT NULL,
    observations     INTEGER NOT NULL,
    fits             INTEGER NOT NULL,
    fitted           INTEGER NOT NULL
) STRICT, WITHOUT ROWID;

CREATE INDEX entry_class ON entry (class);

CREATE INDEX entry_kind ON entry (kind);

CREATE INDEX entry_fitted ON entry (fitted);

CREATE INDEX entry_status ON entry (status);

CREATE INDEX entry_frequency ON entry (frequency_max_hz, frequency_min_hz);

CREATE TABLE entry_tag (
    slug TEXT NOT NULL REFERENCES entry (slug) ON DELETE CASCADE,
    tag  TEXT NOT NULL,
    PRIMARY KEY (slug, tag)
) STRICT, WITHOUT ROWID;

CREATE INDEX entry_tag_tag ON entry_tag (tag, slug);

CREATE TRIGGER search_removed AFTER DELETE ON material BEGIN
    DELETE FROM search WHERE rowid = old.id;
END;

CREATE VIEW entry_tag_made AS
SELECT DISTINCT slug, value AS tag
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN json_each(tags);

CREATE VIEW search_made AS
SELECT material.id AS id, slug, name, class,
    coalesce((SELECT group_concat(value, ', ') FROM json_each(tags)), '') AS tags,
    description, coalesce(finish, '') AS finish,
    coalesce((SELECT group_concat(value, ' ') FROM json_each(unknown)), '') AS unknown,
    coalesce((SELECT group_concat(
        title || coalesce('; ' || (SELECT group_concat(value, '; ') FROM json_each(authors)), ''), ' / ')
        FROM source WHERE revision_id = revision.id), '') AS sources
FROM material JOIN revision ON material_id = material.id AND number = current_revision;

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

CREATE TABLE outline (
    slug          TEXT PRIMARY KEY REFERENCES entry (slug) ON DELETE CASCADE,
    theta_min_rad REAL NOT NULL,
    theta_max_rad REAL NOT NULL,
    model_hash    BLOB CHECK (length(model_hash) = 16),             -- NULL: nothing can be rendered
    levels        BLOB CHECK (length(levels) = 180)                 -- NULL: not known
, footprint TEXT, lobes TEXT) STRICT, WITHOUT ROWID;

CREATE TABLE layer (
    revision_id  INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position     INTEGER NOT NULL,
    name         TEXT    NOT NULL CHECK (length(name) >= 1),
    thickness_m  REAL    CHECK (thickness_m > 0),                   -- NULL: half space
    permittivity TEXT,
    source       TEXT,                                              -- NULL: the entry itself
    PRIMARY KEY (revision_id, position),
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key)
) STRICT;

CREATE TABLE permittivity (
    revision_id      INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position         INTEGER NOT NULL,
    key              TEXT    NOT NULL CHECK (length(key) >= 1),
    frequency_hz     REAL    NOT NULL CHECK (frequency_hz > 0),
    temperature_k    REAL    CHECK (temperature_k > 0),
    real             REAL    NOT NULL,
    imaginary        REAL    NOT NULL CHECK (imaginary >= 0),
    real_sd          REAL    CHECK (real_sd >= 0),
    imaginary_sd     REAL    CHECK (imaginary_sd >= 0),
    source           TEXT    NOT NULL,
    frequency_source TEXT,                                          -- NULL: `source`
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, key, frequency_hz, temperature_k),
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key),
    FOREIGN KEY (revision_id, frequency_source) REFERENCES source (revision_id, key)
) STRICT, WITHOUT ROWID;

CREATE TABLE effect (
    revision_id INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    name        TEXT    NOT NULL CHECK (length(name) >= 1),
    source      TEXT,                                               -- NULL: the entry itself
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, name),
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key)
) STRICT, WITHOUT ROWID;

CREATE TABLE effect_parameter (
    revision_id INTEGER NOT NULL,
    effect      TEXT    NOT NULL,
    name        TEXT    NOT NULL,
    value       REAL    NOT NULL,                                   -- in the unit that ends `name`
    PRIMARY KEY (revision_id, effect, name),
    FOREIGN KEY (revision_id, effect) REFERENCES effect (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE VIEW entry_made AS
SELECT slug, material.id AS material_id, number AS revision, name, class, status,
    (SELECT kind FROM source JOIN (
        SELECT name, source FROM fit WHERE revision_id = revision.id UNION ALL
        SELECT name, source FROM curve WHERE revision_id = revision.id) AS rendered
     ON key = rendered.source
     WHERE revision_id = revision.id AND rendered.name = render) AS kind,
    frequency_min_hz, frequency_max_hz,
    (SELECT count(*) FROM curve WHERE revision_id = revision.id) AS curves,
    (SELECT count(*) FROM observation WHERE revision_id = revision.id) AS observations,
    (SELECT count(*) FROM fit WHERE revision_id = revision.id) AS fits,
    (SELECT count(*) FROM fit
     WHERE revision_id = revision.id AND curve IS NOT NULL AND estimator <> 'stated') AS fitted
FROM material JOIN revision ON material_id = material.id AND number = current_revision;

CREATE TABLE origin_author (
    revision_id INTEGER NOT NULL REFERENCES origin (revision_id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    author      TEXT    NOT NULL CHECK (length(author) >= 1),       -- "Family, Given"
    PRIMARY KEY (revision_id, position)
) STRICT, WITHOUT ROWID;

CREATE VIEW v_findings AS
SELECT slug, number AS revision, effect, verdict, fit_before, fit_after, gain, placebo_gain, p,
    score_difference, score_difference_sd, size_db, rms_before_db, rms_after_db, confusable_with,
    source.title AS source
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN finding ON finding.revision_id = revision.id
JOIN source ON source.revision_id = revision.id AND source.key = finding.source;

CREATE VIRTUAL TABLE search USING fts5 (
    slug, name, class, tags, description, finish, unknown, sources,
    tokenize = 'unicode61 remove_diacritics 2', prefix = '2 3 4'
);

CREATE TABLE fit_number (
    revision_id INTEGER NOT NULL,
    fit         TEXT    NOT NULL,
    position    INTEGER NOT NULL,
    name        TEXT    NOT NULL,                                   -- a parameter's path, S, R, looks
    estimate    TEXT    CHECK (estimate GLOB '$.estimates[[]*]'),   -- JSON path in `fit.report`
    chosen_by   TEXT    NOT NULL CHECK (chosen_by IN ('data', 'hand', 'convention')),
    at_bound    INTEGER NOT NULL CHECK (at_bound IN (0, 1)),
    PRIMARY KEY (revision_id, fit, position),
    CHECK ((estimate IS NULL) = (chosen_by <> 'data')),
    FOREIGN KEY (revision_id, fit) REFERENCES fit (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE TABLE curve_illumination (
    revision_id INTEGER NOT NULL,
    curve       TEXT    NOT NULL,
    footprint   TEXT    CHECK (footprint IN ('paper', 'projected')),  -- NULL: not stated
    beam_rad    REAL    CHECK (beam_rad > 0),                         -- NULL: not stated
    PRIMARY KEY (revision_id, curve),
    CHECK (footprint IS NOT NULL OR beam_rad IS NOT NULL),
    FOREIGN KEY (revision_id, curve) REFERENCES curve (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE TABLE fit_lobes (
    revision_id INTEGER NOT NULL,
    fit         TEXT    NOT NULL,
    lobes       TEXT    NOT NULL CHECK (lobes = 'surface'),           -- no row: of radar and surface together
    PRIMARY KEY (revision_id, fit),
    FOREIGN KEY (revision_id, fit) REFERENCES fit (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE TABLE curve_levels (
    revision_id   INTEGER NOT NULL,
    curve         TEXT    NOT NULL,
    relative      INTEGER NOT NULL CHECK (relative IN (0, 1)),
    only_detected INTEGER NOT NULL CHECK (only_detected IN (0, 1)),
    PRIMARY KEY (revision_id, curve),
    CHECK (relative = 1 OR only_detected = 1),
    FOREIGN KEY (revision_id, curve) REFERENCES curve (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE VIEW fit_estimate AS
SELECT n.revision_id AS revision_id, n.fit AS fit, n.position AS position, n.name AS name,
    CAST(coalesce(p.value, json_extract(report, estimate || '.value')) AS REAL) AS value,
    coalesce(p.unit, '1') AS unit,
    CAST(json_extract(report, estimate || '.sd') AS REAL) AS sd,
    CAST(json_extract(report, estimate || '.interval_95[0]') AS REAL) AS low_95,
    CAST(json_extract(report, estimate || '.interval_95[1]') AS REAL) AS high_95,
    chosen_by, at_bound,
    CAST(at_bound = 0 AND json_extract(report, estimate || '.sd') IS NOT NULL
        AND json_extract(report, estimate || '.interval_95') IS NOT NULL AS INTEGER) AS identified
FROM fit_number AS n
JOIN fit ON fit.revision_id = n.revision_id AND fit.name = n.fit
LEFT JOIN fit_parameter AS p ON p.revision_id = n.revision_id AND p.fit = n.fit AND p.path = n.name;

CREATE VIEW v_fits AS
SELECT slug, number AS revision, fit.name AS fit, estimator, fit.curve AS curve,
    fit.name = render AS is_rendered, p.path AS path, p.value AS value, p.unit AS unit,
    coalesce(e.sd, p.sd) AS sd, low_95, high_95, chosen_by, at_bound, identified,
    coalesce(p.source, fit.source) AS source, source.kind AS kind,
    json_extract(report, '$.held_out.folds') AS held_out_folds,
    json_extract(report, '$.held_out.score') AS held_out_score,
    json_extract(report, '$.held_out.score_sd') AS held_out_score_sd,
    json_extract(report, '$.held_out.rms_db') AS held_out_rms_db,
    coalesce(lobes, 'radar-and-surface') AS lobes
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN fit ON fit.revision_id = revision.id
JOIN fit_parameter AS p ON p.revision_id = revision.id AND p.fit = fit.name
LEFT JOIN fit_estimate AS e ON e.revision_id = revision.id AND e.fit = fit.name AND e.name = p.path
LEFT JOIN fit_lobes AS l ON l.revision_id = revision.id AND l.fit = fit.name
JOIN source ON source.revision_id = revision.id AND source.key = coalesce(p.source, fit.source)
UNION ALL
SELECT slug, number, fit.name, estimator, fit.curve, fit.name = render, e.name, e.value, e.unit, e.sd,
    low_95, high_95, chosen_by, at_bound, identified, fit.source, source.kind,
    json_extract(report, '$.held_out.folds'), json_extract(report, '$.held_out.score'),
    json_extract(report, '$.held_out.score_sd'), json_extract(report, '$.held_out.rms_db'),
    coalesce(lobes, 'radar-and-surface')
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN fit ON fit.revision_id = revision.id
JOIN fit_estimate AS e ON e.revision_id = revision.id AND e.fit = fit.name
LEFT JOIN fit_lobes AS l ON l.revision_id = revision.id AND l.fit = fit.name
JOIN source ON source.revision_id = revision.id AND source.key = fit.source
WHERE NOT EXISTS (SELECT 1 FROM fit_parameter AS p
    WHERE p.revision_id = e.revision_id AND p.fit = e.fit AND p.path = e.name);

CREATE TABLE record (
    revision_id  INTEGER PRIMARY KEY REFERENCES revision (id) ON DELETE CASCADE,
    number_hash  TEXT CHECK (length(number_hash) = 64),             -- name, number and content hash
    date_hash    TEXT CHECK (length(date_hash) = 64),               -- date and program version
    command_hash TEXT CHECK (length(command_hash) = 64),            -- command and its inputs
    origin_hash  TEXT CHECK (length(origin_hash) = 64)              -- catalogue it was imported from
) STRICT;

CREATE VIEW v_curves AS
SELECT slug, number AS revision, curve.name AS curve, source.kind AS kind,
    round(theta_i_rad * 57.29577951308232, 9) AS theta_i_deg,
    round(theta_r_rad * 57.29577951308232, 9) AS theta_r_deg,
    round(delta_phi_rad * 57.29577951308232, 9) AS delta_phi_deg,
    round(theta_sd_rad * 57.29577951308232, 9) AS theta_sd_deg,
    round(10 * log10(sigma0), 9) AS sigma0_db, censor,
    round(10 * log10(threshold_sigma0), 9) AS threshold_db, xt_m, yt_m,
    footprint, beam_rad, coalesce(relative, 0) AS relative, coalesce(only_detected, 0) AS only_detected
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN curve ON curve.revision_id = revision.id
JOIN source ON source.revision_id = revision.id AND source.key = curve.source
JOIN observation
    ON observation.revision_id = revision.id AND observation.curve = curve.name
LEFT JOIN curve_illumination AS i ON i.revision_id = revision.id AND i.curve = curve.name
LEFT JOIN curve_levels AS l ON l.revision_id = revision.id AND l.curve = curve.name;

INSERT INTO unit VALUES ('aperture_m', 'm', 'diameter of the antenna');

INSERT INTO unit VALUES ('at_bound', '1', '1: the search stopped at an end of the number''s range');

INSERT INTO unit VALUES ('bandwidth_hz', 'Hz', 'bandwidth of the instrument');

INSERT INTO unit VALUES ('beam_rad', 'rad', 'divergence lambda/(2 pi w) of the beam that a curve was measured with');

INSERT INTO unit VALUES ('calibration_sd_factor', '1', 'one standard deviation of the level, as a factor');

INSERT INTO unit VALUES ('censored_points', '1', 'number of points of which only a bound is known');

INSERT INTO unit VALUES ('centre_frequency_hz', 'Hz', 'centre frequency of the instrument');

INSERT INTO unit VALUES ('chirp', '1', 'number of the chirp, from 0');

INSERT INTO unit VALUES ('correlation_length_m', 'm', 'length over which heights of the surface are correlated');

INSERT INTO unit VALUES ('covariance', NULL, 'covariance of two parameters, in the product of their units');

INSERT INTO unit VALUES ('current_revision', '1', 'number of the revision that is current');

INSERT INTO unit VALUES ('curves', '1', 'number of curves');

INSERT INTO unit VALUES ('delta_phi_deg', 'deg', 'azimuth between incidence and reflection, 0 in backscatter');

INSERT INTO unit VALUES ('delta_phi_rad', 'rad', 'azimuth between incidence and reflection, 0 in backscatter');

INSERT INTO unit VALUES ('false_alarm_probability', '1', 'probability of a detection without an echo, in one chirp');

INSERT INTO unit VALUES ('fits', '1', 'number of models with parameters');

INSERT INTO unit VALUES ('fitted', '1', 'number of models that were fitted to a curve');

INSERT INTO unit VALUES ('footprint_sd_rad', 'rad', 'standard deviation of the normals within one footprint');

INSERT INTO unit VALUES ('frequency_hz', 'Hz', 'frequency at which the permittivity holds');

INSERT INTO unit VALUES ('frequency_max_ghz', 'GHz', 'highest frequency for which the numbers are claimed');

INSERT INTO unit VALUES ('frequency_max_hz', 'Hz', 'highest frequency for which the numbers are claimed');

INSERT INTO unit VALUES ('frequency_min_ghz', 'GHz', 'lowest frequency for which the numbers are claimed');

INSERT INTO unit VALUES ('frequency_min_hz', 'Hz', 'lowest frequency for which the numbers are claimed');

INSERT INTO unit VALUES ('gain', '1', 'gain in ln likelihood by an effect');

INSERT INTO unit VALUES ('held_out_folds', '1', 'folds that took turns at being held out; NULL: not tried or not possible');

INSERT INTO unit VALUES ('held_out_rms_db', 'dB', 'root mean square of held-out detections over the model fitted to the others');

INSERT INTO unit VALUES ('held_out_score', '1', 'mean ln p of held-out points; NULL: not tried, or a method without a law');

INSERT INTO unit VALUES ('held_out_score_sd', '1', 'standard error of held_out_score over blocks of neighbours');

INSERT INTO unit VALUES ('high_95', NULL, 'upper end of the 95 % interval of `value`, in the same unit');

INSERT INTO unit VALUES ('id', '1', 'number of a row, without a meaning outside this file');

INSERT INTO unit VALUES ('identified', '1', '1: the data tell the number by itself');

INSERT INTO unit VALUES ('imaginary', '1', 'eps'''' of the relative permittivity eps'' - j eps'''', 0 or more');

INSERT INTO unit VALUES ('imaginary_sd', '1', 'standard deviation of the imaginary part');

INSERT INTO unit VALUES ('interval_high', '1', 'upper end of the 95 % interval of the mean, by a bootstrap of blocks');

INSERT INTO unit VALUES ('interval_low', '1', 'lower end of the 95 % interval of the mean, by a bootstrap of blocks');

INSERT INTO unit VALUES ('looks', '1', 'independent looks that one value averages');

INSERT INTO unit VALUES ('low_95', NULL, 'lower end of the 95 % interval of `value`, in the same unit');

INSERT INTO unit VALUES ('material_id', '1', 'the row of `material` that a revision belongs to');

INSERT INTO unit VALUES ('mean_greatest', '1', 'mean of sigma0 in linear power, censored points at their threshold');

INSERT INTO unit VALUES ('mean_least', '1', 'mean of sigma0 in linear power, censored points at 0');

INSERT INTO unit VALUES ('noise_floor_w', 'W', 'power of the noise in a range bin');

INSERT INTO unit VALUES ('normal_sd_rad', 'rad', 'standard deviation of a normal by the error of measurement');

INSERT INTO unit VALUES ('number', '1', 'number of a revision of its material, from 1');

INSERT INTO unit VALUES ('observations', '1', 'number of points on all curves together');

INSERT INTO unit VALUES ('only_detected', '1', '1 where only detections were recorded, so that silent chirps are not known');

INSERT INTO unit VALUES ('p', '1', 'probability of so much by chance, for one test alone');

INSERT INTO unit VALUES ('placebo_gain', '1', 'largest gain in ln likelihood of something meaningless');

INSERT INTO unit VALUES ('points', '1', 'number of points, the censored ones included');

INSERT INTO unit VALUES ('position', '1', 'place in the material''s list, from 0');

INSERT INTO unit VALUES ('power_w', 'W', 'received power; of a censored point the threshold');

INSERT INTO unit VALUES ('quantile_05', '1', '5 % quantile of sigma0; NULL: below threshold_sigma0');

INSERT INTO unit VALUES ('quantile_50', '1', 'median of sigma0; NULL: below threshold_sigma0');

INSERT INTO unit VALUES ('quantile_95', '1', '95 % quantile of sigma0; NULL: below threshold_sigma0');

INSERT INTO unit VALUES ('range_bins', '1', 'number of range bins among which the echo was searched');

INSERT INTO unit VALUES ('range_m', 'm', 'distance from the radar to the point');

INSERT INTO unit VALUES ('real', '1', 'eps'' of the relative permittivity eps'' - j eps''''');

INSERT INTO unit VALUES ('real_sd', '1', 'standard deviation of the real part');

INSERT INTO unit VALUES ('registration_rms_m', 'm', 'root mean square of what the registration left over');

INSERT INTO unit VALUES ('relative', '1', '1 where levels are known up to a common factor only');

INSERT INTO unit VALUES ('relative_humidity', '1', 'relative humidity of the air, 0 to 1');

INSERT INTO unit VALUES ('revision', '1', 'number of a revision of its material, from 1');

INSERT INTO unit VALUES ('revision_id', '1', 'the row of `revision` that this belongs to');

INSERT INTO unit VALUES ('rms_after_db', 'dB', 'root mean square error on held-out data with what was found');

INSERT INTO unit VALUES ('rms_before_db', 'dB', 'root mean square error on held-out data without what was found');

INSERT INTO unit VALUES ('rms_height_m', 'm', 'root mean square of the heights of the surface');

INSERT INTO unit VALUES ('score_difference', '1', 'gain in ln p of held-out data');

INSERT INTO unit VALUES ('score_difference_sd', '1', 'standard error of the gain in ln p');

INSERT INTO unit VALUES ('sd', NULL, 'standard deviation of `value`, in the same unit');

INSERT INTO unit VALUES ('sigma0', '1', 'sigma0 = 4 pi f cos^2(theta), a ratio of powers');

INSERT INTO unit VALUES ('sigma0_db', 'dB', 'sigma0 = 4 pi f cos^2(theta)');

INSERT INTO unit VALUES ('size_db', 'dB', 'root mean square of what an effect changes in the powers');

INSERT INTO unit VALUES ('spot_diameter_m', 'm', 'diameter of the spot between its half-power points');

INSERT INTO unit VALUES ('stand_off_m', 'm', 'distance from the radar to the sample');

INSERT INTO unit VALUES ('temperature_k', 'K', 'temperature');

INSERT INTO unit VALUES ('theta_i_deg', 'deg', 'angle of incidence');

INSERT INTO unit VALUES ('theta_i_rad', 'rad', 'angle of incidence');

INSERT INTO unit VALUES ('theta_max_deg', 'deg', 'largest angle of incidence');

INSERT INTO unit VALUES ('theta_max_rad', 'rad', 'largest angle of incidence');

INSERT INTO unit VALUES ('theta_min_deg', 'deg', 'smallest angle of incidence');

INSERT INTO unit VALUES ('theta_min_rad', 'rad', 'smallest angle of incidence');

INSERT INTO unit VALUES ('theta_r_deg', 'deg', 'angle of reflection');

INSERT INTO unit VALUES ('theta_r_rad', 'rad', 'angle of reflection');

INSERT INTO unit VALUES ('theta_sd_deg', 'deg', 'standard deviation of each tilt of the normal');

INSERT INTO unit VALUES ('theta_sd_rad', 'rad', 'standard deviation of each tilt of the normal');

INSERT INTO unit VALUES ('thickness_m', 'm', 'thickness of a layer; NULL: half space');

INSERT INTO unit VALUES ('threshold_db', 'dB', 'detection limit that applied, as sigma0');

INSERT INTO unit VALUES ('threshold_sigma0', '1', 'detection limit that applied, as sigma0');

INSERT INTO unit VALUES ('threshold_w', 'W', 'least power that counts as a detection');

INSERT INTO unit VALUES ('value', NULL, 'a parameter, in the unit beside it or at the end of its name');

INSERT INTO unit VALUES ('xt_m', 'm', 'place on the target, x of the target plane');

INSERT INTO unit VALUES ('year', 'a', 'year of publication');

INSERT INTO unit VALUES ('yt_m', 'm', 'place on the target, y of the target plane');
