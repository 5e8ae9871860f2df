-- Why: other people's curves are often known up to a common factor only, and their files often hold nothing but
-- detections. A fit that does not know this takes the factor for the surface's, or the cut at the threshold for its law.
--
-- What was stored before has no row here: its levels are absolute, and its silent chirps are points.

CREATE TABLE curve_levels (
    revision_id   INTEGER NOT NULL,
    curve         TEXT    NOT NULL,
    relative      INTEGER NOT NULL CHECK (relative IN (0, 1)),
    only_detected INTEGER NOT NULL CHECK (only_detected IN (0, 1)),
    PRIMARY KEY (revision_id, curve),
    CHECK (relative = 1 OR only_detected = 1),
    FOREIGN KEY (revision_id, curve) REFERENCES curve (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

INSERT INTO unit (column_name, ucum, meaning) VALUES
    ('only_detected', '1', '1 where only detections were recorded, so that silent chirps are not known'),
    ('relative', '1', '1 where levels are known up to a common factor only');

DROP VIEW IF EXISTS v_curves;
CREATE VIEW v_curves AS
SELECT slug, number AS revision, curve.name AS curve, source.kind AS kind,
    theta_i_rad * 57.29577951308232 AS theta_i_deg, theta_r_rad * 57.29577951308232 AS theta_r_deg,
    delta_phi_rad * 57.29577951308232 AS delta_phi_deg, theta_sd_rad * 57.29577951308232 AS theta_sd_deg,
    10 * log10(sigma0) AS sigma0_db, censor, 10 * log10(threshold_sigma0) AS threshold_db, xt_m, yt_m,
    footprint, beam_rad, coalesce(relative, 0) AS relative, coalesce(only_detected, 0) AS only_detected
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN curve ON curve.revision_id = revision.id
JOIN source ON source.revision_id = revision.id AND source.key = curve.source
JOIN observation
    ON observation.revision_id = revision.id AND observation.curve = curve.name
LEFT JOIN curve_illumination AS i ON i.revision_id = revision.id AND i.curve = curve.name
LEFT JOIN curve_levels AS l ON l.revision_id = revision.id AND l.curve = curve.name;
