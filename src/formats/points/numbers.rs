//! Columns of numbers.

/// Columns of numbers under names, all of one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers {
    /// Names of the columns.
    pub names: Vec<String>,
    /// Their numbers, a point each.
    pub columns: Vec<Vec<f64>>,
}
