-- Why: whoever types the first four letters of a word must not wait for a thousand words that begin so: the
-- index keeps such beginnings, too.

DROP TABLE search;
CREATE VIRTUAL TABLE search USING fts5 (
    slug, name, class, tags, description, finish, unknown, sources,
    tokenize = 'unicode61 remove_diacritics 2', prefix = '2 3 4'
);

-- A material with damaged texts is left out of searches: it must not keep the file from being opened.
INSERT INTO search (rowid, slug, name, class, tags, description, finish, unknown, sources)
SELECT * FROM search_made WHERE id IN (
    SELECT material.id FROM material JOIN revision ON material_id = material.id AND number = current_revision
    WHERE json_valid(tags) AND json_valid(unknown)
    AND NOT EXISTS (SELECT 1 FROM source WHERE revision_id = revision.id AND NOT json_valid(authors)));
