-- Why: whoever types the first four letters of a word must not wait for a thousand words that begin so: the
-- index keeps such beginnings, too.

DROP TABLE search;
CREATE VIRTUAL TABLE search USING fts5 (
    slug, name, class, tags, description, finish, unknown, sources,
    tokenize = 'unicode61 remove_diacritics 2', prefix = '2 3 4'
);

INSERT INTO search (rowid, slug, name, class, tags, description, finish, unknown, sources)
SELECT * FROM search_made;
