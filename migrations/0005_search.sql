-- Why: one material among a hundred thousand is found by name, filter or word without reading them all.
-- Each material has one line of what lists show and filters ask for, and one row of a full-text index,
-- both made of its current revision in the transaction that makes a revision current.
--
-- What they are made of says a view each, so that a check can compare.

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

-- Its rows have the numbers of those of `material`.
CREATE VIRTUAL TABLE search USING fts5 (
    slug, name, class, tags, description, finish, unknown, sources,
    tokenize = 'unicode61 remove_diacritics 2', prefix = '2 3'
);

CREATE TRIGGER search_removed AFTER DELETE ON material BEGIN
    DELETE FROM search WHERE rowid = old.id;
END;

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
    (SELECT count(*) FROM fit WHERE revision_id = revision.id AND curve IS NOT NULL) AS fitted
FROM material JOIN revision ON material_id = material.id AND number = current_revision;

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

INSERT INTO entry SELECT * FROM entry_made;
-- A material with damaged texts is left out of searches: it must not keep the file from being opened.
INSERT OR IGNORE INTO entry_tag SELECT DISTINCT slug, value
FROM material JOIN revision ON material_id = material.id AND number = current_revision
JOIN json_each(CASE WHEN json_valid(tags) THEN tags ELSE '[]' END);
INSERT INTO search (rowid, slug, name, class, tags, description, finish, unknown, sources)
SELECT * FROM search_made WHERE id IN (
    SELECT material.id FROM material JOIN revision ON material_id = material.id AND number = current_revision
    WHERE json_valid(tags) AND json_valid(unknown)
    AND NOT EXISTS (SELECT 1 FROM source WHERE revision_id = revision.id AND NOT json_valid(authors)));

INSERT INTO unit (column_name, ucum, meaning) VALUES
    ('curves', '1', 'number of curves'),
    ('fits', '1', 'number of models with parameters'),
    ('fitted', '1', 'number of models that were fitted to a curve'),
    ('observations', '1', 'number of points on all curves together');
