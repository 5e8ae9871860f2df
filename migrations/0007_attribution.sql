-- Why: a number whose source is not named rests on a guess. A layer, an effect and the frequency of a
-- permittivity may name theirs. What a fit says of each of its numbers stands in a table of its own, so
-- that nobody takes a convention for a finding. And a model that was stated beside a curve is no fit to it.
--
-- Whatever was stored before names no such source: NULL. The program fills the estimates of its fits, and
-- the outlines, since a curve answers no farther than its points go.
-- No table refers to those that are made anew here but `effect_parameter`, which is made anew with its own.

CREATE TABLE kept AS SELECT * FROM layer;
DROP TABLE layer;
-- The outermost first. A key of `permittivity` may stand at several frequencies.
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
INSERT INTO layer SELECT revision_id, position, name, thickness_m, permittivity, NULL FROM kept;
DROP TABLE kept;

CREATE TABLE kept AS SELECT * FROM permittivity;
DROP TABLE permittivity;
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
INSERT INTO permittivity
SELECT revision_id, position, key, frequency_hz, temperature_k, real, imaginary, real_sd, imaginary_sd,
    source, NULL FROM kept;
DROP TABLE kept;

CREATE TABLE kept AS SELECT * FROM effect;
CREATE TABLE kept_parameter AS SELECT * FROM effect_parameter;
DROP TABLE effect_parameter;
DROP TABLE effect;
CREATE TABLE effect (
    revision_id INTEGER NOT NULL REFERENCES revision (id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    name        TEXT    NOT NULL CHECK (length(name) >= 1),
    source      TEXT,                                               -- NULL: the entry itself
    PRIMARY KEY (revision_id, position),
    UNIQUE (revision_id, name),
    FOREIGN KEY (revision_id, source) REFERENCES source (revision_id, key)
) STRICT, WITHOUT ROWID;
INSERT INTO effect SELECT revision_id, position, name, NULL FROM kept;
DROP TABLE kept;
-- Parameters that are not listed have the value at which the effect is absent.
CREATE TABLE effect_parameter (
    revision_id INTEGER NOT NULL,
    effect      TEXT    NOT NULL,
    name        TEXT    NOT NULL,
    value       REAL    NOT NULL,                                   -- in the unit that ends `name`
    PRIMARY KEY (revision_id, effect, name),
    FOREIGN KEY (revision_id, effect) REFERENCES effect (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;
INSERT INTO effect_parameter SELECT revision_id, effect, name, value FROM kept_parameter;
DROP TABLE kept_parameter;

-- Made of `fit.report` when a revision is added: every parameter of the model, then what was found beside
-- them, such as S and R.
CREATE TABLE fit_estimate (
    revision_id INTEGER NOT NULL,
    fit         TEXT    NOT NULL,
    position    INTEGER NOT NULL,
    name        TEXT    NOT NULL,                                   -- a parameter's path, S, R, looks
    value       REAL    NOT NULL,                                   -- in `unit`
    unit        TEXT    NOT NULL,                                   -- UCUM code
    sd          REAL    CHECK (sd >= 0),                            -- NULL: not told by itself
    low_95      REAL,
    high_95     REAL    CHECK (high_95 >= low_95),
    chosen_by   TEXT    NOT NULL CHECK (chosen_by IN ('data', 'hand', 'convention')),
    at_bound    INTEGER NOT NULL CHECK (at_bound IN (0, 1)),
    identified  INTEGER NOT NULL CHECK (identified IN (0, 1)),
    PRIMARY KEY (revision_id, fit, position),
    FOREIGN KEY (revision_id, fit) REFERENCES fit (revision_id, name) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

INSERT INTO unit (column_name, ucum, meaning) VALUES
    ('at_bound', '1', '1: the search stopped at an end of the number''s range'),
    ('high_95', NULL, 'upper end of the 95 % interval of `value`, in the same unit'),
    ('identified', '1', '1: the data tell the number by itself'),
    ('low_95', NULL, 'lower end of the 95 % interval of `value`, in the same unit');

DROP VIEW v_fits;
CREATE VIEW v_fits AS
SELECT slug, number AS revision, fit.name AS fit, estimator, fit.curve AS curve,
    fit.name = render AS is_rendered, p.path AS path, p.value AS value, p.unit AS unit,
    coalesce(e.sd, p.sd) AS sd, low_95, high_95, chosen_by, at_bound, identified,
    coalesce(p.source, fit.source) AS source, source.kind AS kind
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN fit ON fit.revision_id = revision.id
JOIN fit_parameter AS p ON p.revision_id = revision.id AND p.fit = fit.name
LEFT JOIN fit_estimate AS e ON e.revision_id = revision.id AND e.fit = fit.name AND e.name = p.path
JOIN source ON source.revision_id = revision.id AND source.key = coalesce(p.source, fit.source)
UNION ALL
SELECT slug, number, fit.name, estimator, fit.curve, fit.name = render, e.name, e.value, e.unit, e.sd,
    low_95, high_95, chosen_by, at_bound, identified, fit.source, source.kind
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN fit ON fit.revision_id = revision.id
JOIN fit_estimate AS e ON e.revision_id = revision.id AND e.fit = fit.name
JOIN source ON source.revision_id = revision.id AND source.key = fit.source
WHERE NOT EXISTS (SELECT 1 FROM fit_parameter AS p
    WHERE p.revision_id = e.revision_id AND p.fit = e.fit AND p.path = e.name);

DROP VIEW entry_made;
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
UPDATE entry SET fitted =
    coalesce((SELECT made.fitted FROM entry_made AS made WHERE made.slug = entry.slug), fitted);
