-- Why: the value of a parameter of a fit's model was stored twice, in `fit_parameter` and in the JSON of
-- `fit.model`, and shown a third time by the table `fit_estimate`. They could disagree. Now `fit_parameter` has it.
-- `fit.model` keeps the structure of the model, with null in the place of every parameter. `fit_estimate` is a view.
--
-- `fit.report` stays as it is, with the values that the fit found in `estimates`: it is the record of the fit, and
-- the content hash covers it apart from the model, which may have been changed since.
--
-- The program takes a value out of `fit.model` only where `fit_parameter` has the same one. Where they
-- disagree, it leaves both: `matdb check` reports the revision, and `matdb check --repair` keeps the value
-- that the content hash covers.

DROP TABLE IF EXISTS fit_estimate;

-- Made of the model and `fit.report` when a revision is added: every parameter of the model, then what else was
-- found, such as S and R. `estimate` is NULL for a number that was not searched for.
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

-- Every number of a fit with a report: the value of a parameter is that of the model, the rest is of the report.
CREATE VIEW fit_estimate AS
SELECT n.revision_id AS revision_id, n.fit AS fit, n.position AS position, n.name AS name,
    CAST(coalesce(p.value, json_extract(report, estimate || '.value')) AS REAL) AS value,
    coalesce(p.unit, '1') AS unit,
    CAST(json_extract(report, estimate || '.sd') AS REAL) AS sd,
    CAST(json_extract(report, estimate || '.interval_95[0]') AS REAL) AS low_95,
    CAST(json_extract(report, estimate || '.interval_95[1]') AS REAL) AS high_95,
    chosen_by, at_bound,
    CAST(at_bound = 0 AND json_extract(report, estimate || '.sd') IS NOT NULL AS INTEGER) AS identified
FROM fit_number AS n
JOIN fit ON fit.revision_id = n.revision_id AND fit.name = n.fit
LEFT JOIN fit_parameter AS p ON p.revision_id = n.revision_id AND p.fit = n.fit AND p.path = n.name;
