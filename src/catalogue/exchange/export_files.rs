//! What writing a material in a foreign format gives.

/// A material in a foreign format.
#[derive(Clone, Debug, PartialEq)]
pub struct Export {
    /// Files by name, all for one folder; the first has the name that was asked for.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the format could not hold, and what replaces it, in a sentence.
    pub lost: String,
}
