//! Regular grids of named channels.

/// A regular grid over (x, y) with named 32-bit channels; NaN marks "nothing here".
///
/// Row 0 is the row of largest y, so that a viewer shows the image upright; column 0 is the
/// smallest x.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// x of the left edge of column 0, m.
    pub x_min_m: f64,
    /// y of the lower edge of the last row, m.
    pub y_min_m: f64,
    /// Side of a square pixel, m.
    pub pixel_m: f64,
    /// Channels in the order they were added.
    pub channels: Vec<Channel>,
}

/// One channel of a [`Raster`], row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name with its unit, such as `power_dbm`.
    pub name: String,
    /// `width · height` values.
    pub values: Vec<f32>,
}

impl Raster {
    /// x of the centre of a column, m.
    pub fn x_m(&self, column: usize) -> f64 {
        self.x_min_m + (column as f64 + 0.5) * self.pixel_m
    }

    /// y of the centre of a row, m.
    pub fn y_m(&self, row: usize) -> f64 {
        self.y_min_m + ((self.height - row) as f64 - 0.5) * self.pixel_m
    }

    /// Whether a point lies on the grid, m.
    pub fn contains(&self, x_m: f64, y_m: f64) -> bool {
        let within = |at_m: f64, min_m: f64, pixels: usize| {
            at_m >= min_m && at_m <= min_m + pixels as f64 * self.pixel_m
        };
        within(x_m, self.x_min_m, self.width) && within(y_m, self.y_min_m, self.height)
    }

    /// A channel's values by name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }
}
