-- Why: the level of a curve depends on how the lit area was counted, by 3 dB at 60 degrees, and the width of its lobe
-- on the beam that it was measured with. Neither was stored. Nor was it stored whether the lobes of a fit are those
-- of the surface alone or those of radar and surface together.
--
-- What was stored before has no row here: nothing in a database says how it was reduced. Its lobes are those of
-- radar and surface together.

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

-- Of what scenes render. NULL is right for all that was stored before.
ALTER TABLE outline ADD COLUMN footprint TEXT;
ALTER TABLE outline ADD COLUMN lobes TEXT;

INSERT INTO unit (column_name, ucum, meaning) VALUES
    ('beam_rad', 'rad', 'divergence lambda/(2 pi w) of the beam that a curve was measured with');

DROP VIEW IF EXISTS v_curves;
CREATE VIEW v_curves AS
SELECT slug, number AS revision, curve.name AS curve, source.kind AS kind,
    theta_i_rad * 57.29577951308232 AS theta_i_deg, theta_r_rad * 57.29577951308232 AS theta_r_deg,
    delta_phi_rad * 57.29577951308232 AS delta_phi_deg, theta_sd_rad * 57.29577951308232 AS theta_sd_deg,
    10 * log10(sigma0) AS sigma0_db, censor, 10 * log10(threshold_sigma0) AS threshold_db, xt_m, yt_m,
    footprint, beam_rad
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN curve ON curve.revision_id = revision.id
JOIN source ON source.revision_id = revision.id AND source.key = curve.source
JOIN observation
    ON observation.revision_id = revision.id AND observation.curve = curve.name
LEFT JOIN curve_illumination AS i ON i.revision_id = revision.id AND i.curve = curve.name;

DROP VIEW IF EXISTS v_fits;
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
