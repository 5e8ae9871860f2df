-- Why: a number whose interval the search could not close was called told by the data where it had a standard deviation,
-- though another number may vary with it without a change of the curve.

DROP VIEW IF EXISTS v_fits;
DROP VIEW IF EXISTS fit_estimate;

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
