-- Why: what is published must say what a number means, where it comes from and how far it holds. A
-- revision keeps what it is made of, how rough it is, in which sessions and with which instrument it
-- was measured, what was tried on it and not found, whether it may still be used, and which command
-- made it of what. Curves keep their statistics, every numeric column its unit, and views show people
-- decibels and degrees.
--
-- Whatever was stored before knows none of this: NULL, an empty list, or no row.
-- Permittivity is relative, eps' - j eps'' for exp(+j w t), so that eps'' is not negative.

ALTER TABLE revision ADD COLUMN status TEXT NOT NULL DEFAULT 'active'
    CHECK (status IN ('active', 'superseded', 'withdrawn'));
ALTER TABLE revision ADD COLUMN status_reason TEXT
    CHECK ((status_reason IS NULL) = (status = 'active'));
ALTER TABLE revision ADD COLUMN superseded_by TEXT
    CHECK ((superseded_by IS NOT NULL) = (status = 'superseded'));
ALTER TABLE revision ADD COLUMN finish TEXT;
ALTER TABLE revision ADD COLUMN unknown TEXT NOT NULL DEFAULT '[]'
    CHECK (json_type(unknown) = 'array');                           -- sentences

ALTER TABLE source ADD COLUMN authors TEXT NOT NULL DEFAULT '[]'
    CHECK (json_type(authors) = 'array');
ALTER TABLE source ADD COLUMN year INTEGER CHECK (year BETWEEN 1000 AND 9999);
ALTER TABLE source ADD COLUMN container TEXT;
ALTER TABLE source ADD COLUMN volume TEXT;
ALTER TABLE source ADD COLUMN pages TEXT;
ALTER TABLE source ADD COLUMN publisher TEXT;
ALTER TABLE source ADD COLUMN making TEXT
    CHECK (making IN ('own-measurement', 'copied', 'digitised', 'computed'));

ALTER TABLE instrument ADD COLUMN transmit_polarisation TEXT;
ALTER TABLE instrument ADD COLUMN receive_polarisation TEXT;
ALTER TABLE instrument ADD COLUMN geometry TEXT CHECK (geometry IN ('monostatic', 'bistatic'));
ALTER TABLE instrument ADD COLUMN stand_off_m REAL CHECK (stand_off_m > 0);
ALTER TABLE instrument ADD COLUMN spot_diameter_m REAL CHECK (spot_diameter_m > 0);
ALTER TABLE instrument ADD COLUMN aperture_m REAL CHECK (aperture_m > 0);
ALTER TABLE instrument ADD COLUMN calibration_target TEXT;
ALTER TABLE instrument ADD COLUMN calibration_sd_factor REAL CHECK (calibration_sd_factor >= 1);
ALTER TABLE instrument ADD COLUMN scale TEXT CHECK (scale IN ('absolute', 'relative'));
ALTER TABLE instrument ADD COLUMN noise_floor_w REAL CHECK (noise_floor_w > 0);
ALTER TABLE instrument ADD COLUMN threshold_w REAL CHECK (threshold_w > 0);
ALTER TABLE instrument ADD COLUMN false_alarm_probability REAL
    CHECK (false_alarm_probability > 0 AND false_alarm_probability < 1);
ALTER TABLE instrument ADD COLUMN range_bins INTEGER CHECK (range_bins BETWEEN 1 AND 4294967295);
ALTER TABLE instrument ADD COLUMN looks REAL CHECK (looks > 0);
ALTER TABLE instrument ADD COLUMN looks_method TEXT;

CREATE TABLE permittivity (
    revision_id   INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position      INTEGER NOT NULL,
    key           TEXT    NOT NULL CHECK (length(key) >= 1),
    frequency_hz  REAL    NOT NULL CHECK (frequency_hz > 0),
    temperature_k REAL    CHECK (temperature_k > 0),
    real          REAL    NOT NULL,
    imaginary     REAL    NOT NULL CHECK (imaginary >= 0),
    real_sd       REAL    CHECK (real_sd >= 0),
    imaginary_sd  REAL    CHECK (imaginary_sd >= 0),
    source        TEXT    NOT NULL,
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, key, frequency_hz, temperature_k),
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key)
) STRICT, WITHOUT ROWID;

-- The outermost first. A key of `permittivity` may stand at several frequencies.
CREATE TABLE layer (
    revision_id  INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position     INTEGER NOT NULL,
    name         TEXT    NOT NULL CHECK (length(name) >= 1),
    thickness_m  REAL    CHECK (thickness_m > 0),                   -- NULL: half space
    permittivity TEXT,
    PRIMARY KEY (revision_id, position)
) STRICT, WITHOUT ROWID;

-- At most one of a revision. A column of `revision` could not refer to its source.
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

-- A column of `curve` added later could not refer to a session.
CREATE TABLE curve_session (
    revision_id INTEGER NOT NULL,
    curve       TEXT    NOT NULL,
    session     TEXT    NOT NULL,
    PRIMARY KEY (revision_id, curve),
    FOREIGN KEY (revision_id, curve) REFERENCES curve (revision_id, name) ON DELETE CASCADE,
    FOREIGN KEY (revision_id, session) REFERENCES session (revision_id, key) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

-- Made of the observations when a revision is added. The mean is in linear power; what lies below the
-- threshold is anywhere from 0 to the threshold, so that the mean has a least and a greatest value. A
-- quantile that falls among such points is NULL: below `threshold_sigma0`.
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

-- Which command made a revision; not part of what the revision says of the material.
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

-- Every numeric column of every table and view, by its name.
CREATE TABLE unit (
    column_name TEXT PRIMARY KEY,
    ucum        TEXT,                                               -- NULL: the row says which
    meaning     TEXT NOT NULL
) STRICT, WITHOUT ROWID;

INSERT INTO unit (column_name, ucum, meaning) VALUES
    ('aperture_m', 'm', 'diameter of the antenna'),
    ('bandwidth_hz', 'Hz', 'bandwidth of the instrument'),
    ('calibration_sd_factor', '1', 'one standard deviation of the level, as a factor'),
    ('censored_points', '1', 'number of points of which only a bound is known'),
    ('centre_frequency_hz', 'Hz', 'centre frequency of the instrument'),
    ('chirp', '1', 'number of the chirp, from 0'),
    ('correlation_length_m', 'm', 'length over which heights of the surface are correlated'),
    ('covariance', NULL, 'covariance of two parameters, in the product of their units'),
    ('current_revision', '1', 'number of the revision that is current'),
    ('delta_phi_rad', 'rad', 'azimuth between incidence and reflection, 0 in backscatter'),
    ('false_alarm_probability', '1', 'probability of a detection without an echo, in one chirp'),
    ('footprint_sd_rad', 'rad', 'standard deviation of the normals within one footprint'),
    ('frequency_hz', 'Hz', 'frequency at which the permittivity holds'),
    ('frequency_max_ghz', 'GHz', 'highest frequency for which the numbers are claimed'),
    ('frequency_max_hz', 'Hz', 'highest frequency for which the numbers are claimed'),
    ('frequency_min_ghz', 'GHz', 'lowest frequency for which the numbers are claimed'),
    ('frequency_min_hz', 'Hz', 'lowest frequency for which the numbers are claimed'),
    ('gain', '1', 'gain in ln likelihood by an effect'),
    ('id', '1', 'number of a row, without a meaning outside this file'),
    ('imaginary', '1', 'eps'''' of the relative permittivity eps'' - j eps'''', 0 or more'),
    ('imaginary_sd', '1', 'standard deviation of the imaginary part'),
    ('interval_high', '1', 'upper end of the 95 % interval of the mean, by a bootstrap of blocks'),
    ('interval_low', '1', 'lower end of the 95 % interval of the mean, by a bootstrap of blocks'),
    ('looks', '1', 'independent looks that one value averages'),
    ('material_id', '1', 'the row of `material` that a revision belongs to'),
    ('mean_greatest', '1', 'mean of sigma0 in linear power, censored points at their threshold'),
    ('mean_least', '1', 'mean of sigma0 in linear power, censored points at 0'),
    ('noise_floor_w', 'W', 'power of the noise in a range bin'),
    ('normal_sd_rad', 'rad', 'standard deviation of a normal by the error of measurement'),
    ('number', '1', 'number of a revision of its material, from 1'),
    ('p', '1', 'probability of so much by chance, for one test alone'),
    ('placebo_gain', '1', 'largest gain in ln likelihood of something meaningless'),
    ('points', '1', 'number of points, the censored ones included'),
    ('position', '1', 'place in the material''s list, from 0'),
    ('power_w', 'W', 'received power; of a censored point the threshold'),
    ('quantile_05', '1', '5 % quantile of sigma0; NULL: below threshold_sigma0'),
    ('quantile_50', '1', 'median of sigma0; NULL: below threshold_sigma0'),
    ('quantile_95', '1', '95 % quantile of sigma0; NULL: below threshold_sigma0'),
    ('range_bins', '1', 'number of range bins among which the echo was searched'),
    ('range_m', 'm', 'distance from the radar to the point'),
    ('real', '1', 'eps'' of the relative permittivity eps'' - j eps'''''),
    ('real_sd', '1', 'standard deviation of the real part'),
    ('registration_rms_m', 'm', 'root mean square of what the registration left over'),
    ('relative_humidity', '1', 'relative humidity of the air, 0 to 1'),
    ('revision', '1', 'number of a revision of its material, from 1'),
    ('revision_id', '1', 'the row of `revision` that this belongs to'),
    ('rms_after_db', 'dB', 'root mean square error on held-out data with what was found'),
    ('rms_before_db', 'dB', 'root mean square error on held-out data without what was found'),
    ('rms_height_m', 'm', 'root mean square of the heights of the surface'),
    ('score_difference', '1', 'gain in ln p of held-out data'),
    ('score_difference_sd', '1', 'standard error of the gain in ln p'),
    ('sd', NULL, 'standard deviation of `value`, in the same unit'),
    ('sigma0', '1', 'sigma0 = 4 pi f cos^2(theta), a ratio of powers'),
    ('sigma0_db', 'dB', 'sigma0 = 4 pi f cos^2(theta)'),
    ('size_db', 'dB', 'root mean square of what an effect changes in the powers'),
    ('spot_diameter_m', 'm', 'diameter of the spot between its half-power points'),
    ('stand_off_m', 'm', 'distance from the radar to the sample'),
    ('temperature_k', 'K', 'temperature'),
    ('theta_i_deg', 'deg', 'angle of incidence'),
    ('theta_i_rad', 'rad', 'angle of incidence'),
    ('theta_max_deg', 'deg', 'largest angle of incidence'),
    ('theta_max_rad', 'rad', 'largest angle of incidence'),
    ('theta_min_deg', 'deg', 'smallest angle of incidence'),
    ('theta_min_rad', 'rad', 'smallest angle of incidence'),
    ('theta_r_deg', 'deg', 'angle of reflection'),
    ('theta_r_rad', 'rad', 'angle of reflection'),
    ('delta_phi_deg', 'deg', 'azimuth between incidence and reflection, 0 in backscatter'),
    ('theta_sd_deg', 'deg', 'standard deviation of each tilt of the normal'),
    ('theta_sd_rad', 'rad', 'standard deviation of each tilt of the normal'),
    ('thickness_m', 'm', 'thickness of a layer; NULL: half space'),
    ('threshold_db', 'dB', 'detection limit that applied, as sigma0'),
    ('threshold_sigma0', '1', 'detection limit that applied, as sigma0'),
    ('threshold_w', 'W', 'least power that counts as a detection'),
    ('value', NULL, 'a parameter, in the unit beside it or at the end of its name'),
    ('year', 'a', 'year of publication');

-- For people: current revisions, in decibels and degrees. Decibels need an SQLite with log10, as the
-- sqlite3 program has it.
CREATE VIEW v_materials AS
SELECT slug, number AS revision, name, class, status, status_reason, superseded_by, licence,
    frequency_min_hz / 1e9 AS frequency_min_ghz, frequency_max_hz / 1e9 AS frequency_max_ghz,
    theta_min_rad * 57.29577951308232 AS theta_min_deg, theta_max_rad * 57.29577951308232 AS theta_max_deg,
    render, description
FROM material JOIN revision ON material_id = material.id AND number = current_revision;

CREATE VIEW v_curves AS
SELECT slug, number AS revision, curve.name AS curve, source.kind AS kind,
    theta_i_rad * 57.29577951308232 AS theta_i_deg, theta_r_rad * 57.29577951308232 AS theta_r_deg,
    delta_phi_rad * 57.29577951308232 AS delta_phi_deg, theta_sd_rad * 57.29577951308232 AS theta_sd_deg,
    10 * log10(sigma0) AS sigma0_db, censor, 10 * log10(threshold_sigma0) AS threshold_db
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN curve ON curve.revision_id = revision.id
JOIN source ON source.revision_id = revision.id AND source.key = curve.source
JOIN observation
    ON observation.revision_id = revision.id AND observation.curve = curve.name;

CREATE VIEW v_fits AS
SELECT slug, number AS revision, fit.name AS fit, estimator, fit.curve AS curve,
    fit.name = render AS is_rendered, path, value, unit, sd,
    coalesce(fit_parameter.source, fit.source) AS source, source.kind AS kind
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN fit ON fit.revision_id = revision.id
JOIN fit_parameter ON fit_parameter.revision_id = revision.id AND fit_parameter.fit = fit.name
JOIN source ON source.revision_id = revision.id
    AND source.key = coalesce(fit_parameter.source, fit.source);
