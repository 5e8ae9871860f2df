-- Why: neighbouring points of a scan are no independent witnesses, and where they lie on the target tells
-- which are neighbours. A fit that was judged only by the points it was made of flatters itself; one that
-- was tried on points held out says how it did, and people read it beside its numbers. Findings stand where
-- people look.
--
-- Of what was stored before nobody noted the places: NULL.

ALTER TABLE observation ADD COLUMN xt_m REAL;                       -- of the frame St
ALTER TABLE observation ADD COLUMN yt_m REAL CHECK ((yt_m IS NULL) = (xt_m IS NULL));

INSERT INTO unit (column_name, ucum, meaning) VALUES
    ('held_out_folds', '1', 'folds that took turns at being held out; NULL: not tried or not possible'),
    ('held_out_rms_db', 'dB', 'root mean square of held-out detections over the model fitted to the others'),
    ('held_out_score', '1', 'mean ln p of held-out points; NULL: not tried, or a method without a law'),
    ('held_out_score_sd', '1', 'standard error of held_out_score over blocks of neighbours'),
    ('xt_m', 'm', 'place on the target, x of the target plane'),
    ('yt_m', 'm', 'place on the target, y of the target plane');

DROP VIEW v_curves;
CREATE VIEW v_curves AS
SELECT slug, number AS revision, curve.name AS curve, source.kind AS kind,
    theta_i_rad * 57.29577951308232 AS theta_i_deg, theta_r_rad * 57.29577951308232 AS theta_r_deg,
    delta_phi_rad * 57.29577951308232 AS delta_phi_deg, theta_sd_rad * 57.29577951308232 AS theta_sd_deg,
    10 * log10(sigma0) AS sigma0_db, censor, 10 * log10(threshold_sigma0) AS threshold_db, xt_m, yt_m
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN curve ON curve.revision_id = revision.id
JOIN source ON source.revision_id = revision.id AND source.key = curve.source
JOIN observation
    ON observation.revision_id = revision.id AND observation.curve = curve.name;

DROP VIEW v_fits;
CREATE VIEW v_fits AS
SELECT slug, number AS revision, fit.name AS fit, estimator, fit.curve AS curve,
    fit.name = render AS is_rendered, p.path AS path, p.value AS value, p.unit AS unit,
    coalesce(e.sd, p.sd) AS sd, low_95, high_95, chosen_by, at_bound, identified,
    coalesce(p.source, fit.source) AS source, source.kind AS kind,
    json_extract(report, '$.held_out.folds') AS held_out_folds,
    json_extract(report, '$.held_out.score') AS held_out_score,
    json_extract(report, '$.held_out.score_sd') AS held_out_score_sd,
    json_extract(report, '$.held_out.rms_db') AS held_out_rms_db
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN fit ON fit.revision_id = revision.id
JOIN fit_parameter AS p ON p.revision_id = revision.id AND p.fit = fit.name
LEFT JOIN fit_estimate AS e ON e.revision_id = revision.id AND e.fit = fit.name AND e.name = p.path
JOIN source ON source.revision_id = revision.id AND source.key = coalesce(p.source, fit.source)
UNION ALL
SELECT slug, number, fit.name, estimator, fit.curve, fit.name = render, e.name, e.value, e.unit, e.sd,
    low_95, high_95, chosen_by, at_bound, identified, fit.source, source.kind,
    json_extract(report, '$.held_out.folds'), json_extract(report, '$.held_out.score'),
    json_extract(report, '$.held_out.score_sd'), json_extract(report, '$.held_out.rms_db')
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN fit ON fit.revision_id = revision.id
JOIN fit_estimate AS e ON e.revision_id = revision.id AND e.fit = fit.name
JOIN source ON source.revision_id = revision.id AND source.key = fit.source
WHERE NOT EXISTS (SELECT 1 FROM fit_parameter AS p
    WHERE p.revision_id = e.revision_id AND p.fit = e.fit AND p.path = e.name);

CREATE VIEW v_findings AS
SELECT slug, number AS revision, effect, verdict, fit_before, fit_after, gain, placebo_gain, p,
    score_difference, score_difference_sd, size_db, rms_before_db, rms_after_db, confusable_with,
    source.title AS source
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN finding ON finding.revision_id = revision.id
JOIN source ON source.revision_id = revision.id AND source.key = finding.source;
