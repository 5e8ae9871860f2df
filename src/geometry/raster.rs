//! Regular grids of named channels.

use std::ops::Range;

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

    /// The rows and columns in which pixels may have their centres within a distance of a place, m.
    pub fn span_near(&self, [x_m, y_m]: [f64; 2], distance_m: f64) -> [Range<usize>; 2] {
        let [columns, from_below] =
            [(x_m, self.x_min_m, self.width), (y_m, self.y_min_m, self.height)].map(
                |(centre_m, min_m, count)| {
                    let first =
                        ((centre_m - distance_m - min_m) / self.pixel_m - 0.5).ceil().max(0.0);
                    let end = ((centre_m + distance_m - min_m) / self.pixel_m + 0.5).floor();
                    // The conversion to integers saturates: a place outside the grid gives an empty span.
                    (first as usize).min(count)..(end as usize).min(count)
                },
            );
        [self.height - from_below.end..self.height - from_below.start, columns]
    }

    /// The pixels in some rows and columns whose centres are within a distance of a place, with their distances, m.
    pub fn pixels_near(
        &self,
        [x_m, y_m]: [f64; 2],
        distance_m: f64,
        [rows, columns]: [Range<usize>; 2],
    ) -> impl Iterator<Item = (usize, f64)> {
        rows.flat_map(move |row| {
            columns.clone().filter_map(move |column| {
                let pixel_m = (self.x_m(column) - x_m).hypot(self.y_m(row) - y_m);
                (pixel_m <= distance_m).then_some((row * self.width + column, pixel_m))
            })
        })
    }

    /// Whether a point lies on the grid, m.
    pub fn contains(&self, x_m: f64, y_m: f64) -> bool {
        let within = |at_m: f64, min_m: f64, pixels: usize| {
            at_m >= min_m && at_m <= min_m + pixels as f64 * self.pixel_m
        };
        within(x_m, self.x_min_m, self.width) && within(y_m, self.y_min_m, self.height)
    }

    /// Rows and columns that hold numbers of a channel; `None` where there are none.
    pub fn filled(&self, channel: &str) -> Option<[Range<usize>; 2]> {
        let values = self.channel(channel)?;
        let mut filled: Option<[Range<usize>; 2]> = None;
        for (row, values) in values.chunks(self.width.max(1)).enumerate() {
            let first = values.iter().position(|value| !value.is_nan());
            let last = values.iter().rposition(|value| !value.is_nan());
            if let (Some(first), Some(last)) = (first, last) {
                let own = [row..row + 1, first..last + 1];
                filled = Some(filled.map_or(own.clone(), |before| joined(before, own)));
            }
        }
        filled
    }

    /// The part in these rows and columns, which it has.
    pub fn part(&self, [rows, columns]: [Range<usize>; 2]) -> Raster {
        let channels = self.channels.iter().map(|channel| {
            let lines = rows.clone().map(|row| row * self.width);
            let values =
                lines.flat_map(|line| &channel.values[line + columns.start..line + columns.end]);
            Channel { name: channel.name.clone(), values: values.copied().collect() }
        });
        Raster {
            width: columns.len(),
            height: rows.len(),
            x_min_m: self.x_min_m + columns.start as f64 * self.pixel_m,
            y_min_m: self.y_min_m + (self.height - rows.end) as f64 * self.pixel_m,
            pixel_m: self.pixel_m,
            channels: channels.collect(),
        }
    }

    /// A channel's values by name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }
}

/// The smallest rows and columns that hold both.
pub fn joined(a: [Range<usize>; 2], b: [Range<usize>; 2]) -> [Range<usize>; 2] {
    let ([rows, columns], [other_rows, other_columns]) = (a, b);
    [(rows, other_rows), (columns, other_columns)]
        .map(|(a, b)| a.start.min(b.start)..a.end.max(b.end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_keeps_places_and_values() {
        let mut values = vec![f32::NAN; 20];
        (values[6], values[12]) = (1.0, 2.0);
        let channels = vec![Channel { name: "power_dbm".to_owned(), values }];
        let (width, height, pixel_m) = (5, 4, 0.5);
        let whole = Raster { width, height, x_min_m: -1.0, y_min_m: 2.0, pixel_m, channels };
        let filled = whole.filled("power_dbm").unwrap();
        assert_eq!(filled, [1..3, 1..3]);
        assert_eq!(
            (whole.filled("range_m"), joined(filled.clone(), [0..1, 4..5])),
            (None, [0..3, 1..5])
        );
        let part = whole.part(filled);
        assert_eq!((part.width, part.height), (2, 2));
        let values = part.channel("power_dbm").unwrap();
        assert_eq!([values[0], values[3]], [1.0, 2.0]);
        assert_eq!((part.x_m(0), part.y_m(0)), (whole.x_m(1), whole.y_m(1)));
        assert_eq!(whole.part([0..4, 0..5]).y_min_m, whole.y_min_m);
    }
}
