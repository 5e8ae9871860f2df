-- Why: an angle of 12.3 degrees and a level of -12.3 dB are kept in radians and as a ratio, and the view showed them with the
-- last digits of that way and back, as 12.299999999999999. It shows what was typed, to nine decimals.

DROP VIEW v_curves;
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
