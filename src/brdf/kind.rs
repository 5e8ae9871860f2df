//! What is known of a kind of model without an instance of it: its name, its keys in files, and values
//! from which a fit can start.

/// A kind of scattering model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// Its name in files, the value of `model`.
    pub name: &'static str,
    /// The other keys of its JSON, in the order in which they are written.
    pub keys: &'static [Key],
    /// Values from which a search can start, as JSON, each by the name that people call it by. They are
    /// guesses of the right order for dry solids near 300 GHz.
    pub starts: &'static [(&'static str, &'static str)],
}

/// One key of a model in JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// JSON Schema of its value.
    pub schema: &'static str,
    /// Whether every model of the kind is written with it.
    pub required: bool,
}

impl Key {
    /// A number that is always written.
    pub(super) const fn number(name: &'static str) -> Key {
        Key::new(name, r#"{"type": "number"}"#)
    }

    /// A value of this JSON Schema that is always written.
    pub(super) const fn new(name: &'static str, schema: &'static str) -> Key {
        Key { name, schema, required: true }
    }

    /// The same key, which may be absent.
    pub(super) const fn optional(self) -> Key {
        Key { required: false, ..self }
    }
}
