//! The rows of a scan: every return of every chirp with its cause, and a row for each chirp without one.

use super::labels::{Labels, Sight};
use super::table::{Column, Kind, Values};
use crate::radar::Channel;
use crate::render::{Echo, Truth};
use crate::setup::{ReadyScene, View};
use crate::units::{db_from_ratio, dbm_from_watts};

/// A row before it is stored in columns.
struct Row<'a> {
    scan: i32,
    antenna: i32,
    cross_polar: bool,
    chirp: u32,
    aim_m: [f64; 2],
    detected: bool,
    echo: Option<&'a Echo>,
    sight: Option<&'a Sight>,
    object_share: f32,
}

impl Row<'_> {
    fn truth(&self) -> Option<&Truth> {
        self.echo?.truth.as_ref()
    }

    fn of_echo(&self, value: fn(&Echo) -> f64) -> f32 {
        self.echo.map_or(f32::NAN, |echo| value(echo) as f32)
    }

    fn of_truth(&self, value: fn(&Truth) -> f64) -> f32 {
        self.truth().map_or(f32::NAN, |truth| value(truth) as f32)
    }

    fn of_sight(&self, value: fn(&Sight) -> f64) -> f32 {
        self.sight.map_or(f32::NAN, |sight| value(sight) as f32)
    }
}

/// A power in dBm; NaN for none.
fn dbm(power_w: f64) -> f64 {
    if power_w > 0.0 { dbm_from_watts(power_w) } else { f64::NAN }
}

/// How a column is filled.
enum Fill {
    Int(Kind, fn(&Row, &Labels) -> i32),
    Float(fn(&Row) -> f32),
    Bool(fn(&Row, &Labels) -> bool),
}

/// Name, unit, meaning and filling of a column.
type Entry = (&'static str, &'static str, &'static str, Fill);

const COLUMNS: [Entry; 32] = [
    (
        "scan",
        "",
        "number of the scan, as in the table of scans",
        Fill::Int(Kind::Int32, |row, _| row.scan),
    ),
    (
        "antenna",
        "",
        "0 for the radar, then the receivers of the scene",
        Fill::Int(Kind::Int8, |row, _| row.antenna),
    ),
    (
        "cross_polar",
        "",
        "whether it is the cross-polar channel",
        Fill::Bool(|row, _| row.cross_polar),
    ),
    ("chirp", "", "number of the chirp", Fill::Int(Kind::Int32, |row, _| row.chirp as i32)),
    (
        "rank",
        "",
        "place among the returns of the chirp by power, from 1; 0 for none",
        Fill::Int(Kind::Int16, |row, _| row.echo.map_or(0, |echo| echo.rank.into())),
    ),
    ("detected", "", "whether the power reaches the threshold", Fill::Bool(|row, _| row.detected)),
    (
        "xt_m",
        "m",
        "x of the beam's axis in the target plane",
        Fill::Float(|row| row.aim_m[0] as f32),
    ),
    (
        "yt_m",
        "m",
        "y of the beam's axis in the target plane",
        Fill::Float(|row| row.aim_m[1] as f32),
    ),
    (
        "x_m",
        "m",
        "measured place, global frame",
        Fill::Float(|row| row.of_echo(|echo| echo.point.xyz.x)),
    ),
    (
        "y_m",
        "m",
        "measured place, global frame",
        Fill::Float(|row| row.of_echo(|echo| echo.point.xyz.y)),
    ),
    (
        "z_m",
        "m",
        "measured place, global frame",
        Fill::Float(|row| row.of_echo(|echo| echo.point.xyz.z)),
    ),
    ("range_m", "m", "measured range", Fill::Float(|row| row.of_echo(|echo| echo.range_m))),
    (
        "power_dbm",
        "dB[mW]",
        "measured power",
        Fill::Float(|row| row.of_echo(|echo| dbm(echo.power_w))),
    ),
    (
        "mean_power_dbm",
        "dB[mW]",
        "mean power of what caused the return, over speckle and noise",
        Fill::Float(|row| row.of_truth(|truth| dbm(truth.mean_power_w))),
    ),
    (
        "true_range_m",
        "m",
        "range of what caused the return",
        Fill::Float(|row| row.of_truth(|truth| truth.hit.range_m)),
    ),
    (
        "theta_deg",
        "deg",
        "angle of incidence there",
        Fill::Float(|row| row.of_truth(|truth| truth.hit.theta_rad().to_degrees())),
    ),
    (
        "theta_sd_deg",
        "deg",
        "standard deviation of the angle over the spot",
        Fill::Float(|row| row.of_truth(|truth| truth.theta_sd_rad.to_degrees())),
    ),
    (
        "azimuth_deg",
        "deg",
        "azimuth of the radar about the normal, from the grain",
        Fill::Float(|row| row.of_truth(|truth| truth.azimuth_rad.to_degrees())),
    ),
    (
        "specular_share",
        "1",
        "specular share of the power",
        Fill::Float(|row| row.of_truth(|truth| truth.specular_share)),
    ),
    (
        "edge_m",
        "m",
        "distance to the nearest edge in depth",
        Fill::Float(|row| row.of_truth(|truth| truth.edge_m)),
    ),
    (
        "facet",
        "",
        "facet that caused the return",
        Fill::Int(Kind::Int32, |row, _| row.truth().map_or(-1, |truth| truth.hit.facet as i32)),
    ),
    (
        "instance",
        "",
        "mesh that caused the return, from 1",
        Fill::Int(Kind::Int16, |row, labels| {
            row.truth().map_or(-1, |truth| labels.instance(truth.hit.facet).into())
        }),
    ),
    (
        "region",
        "",
        "region that caused the return",
        Fill::Int(Kind::Int16, |row, _| row.truth().map_or(-1, |truth| truth.region.into())),
    ),
    (
        "material",
        "",
        "material that caused the return",
        Fill::Int(Kind::Int16, |row, labels| {
            row.truth().map_or(-1, |truth| labels.material(truth.region).into())
        }),
    ),
    (
        "surfaces",
        "",
        "surfaces on the path: 1, or 2 after a second bounce",
        Fill::Int(Kind::Int8, |row, _| row.truth().map_or(-1, |truth| truth.surfaces.into())),
    ),
    (
        "sheets",
        "",
        "sheets in front of what caused the return",
        Fill::Int(Kind::Int8, |row, _| row.truth().map_or(-1, |truth| truth.sheets.into())),
    ),
    (
        "passed_db",
        "dB",
        "what these sheets let through, there and back",
        Fill::Float(|row| row.of_truth(|truth| db_from_ratio(truth.passed_share))),
    ),
    (
        "sight_instance",
        "",
        "mesh along the axis behind all sheets, from 1",
        Fill::Int(Kind::Int16, |row, _| row.sight.map_or(-1, |sight| sight.instance.into())),
    ),
    (
        "sight_material",
        "",
        "its material",
        Fill::Int(Kind::Int16, |row, _| row.sight.map_or(-1, |sight| sight.material.into())),
    ),
    ("sight_range_m", "m", "its range", Fill::Float(|row| row.of_sight(|sight| sight.hit.range_m))),
    (
        "threat_share",
        "1",
        "share of the spot's rays that hit an object that is looked for, behind sheets",
        Fill::Float(|row| row.object_share),
    ),
    (
        "threat",
        "",
        "whether the axis hits such an object behind sheets",
        Fill::Bool(|row, labels| row.sight.is_some_and(|sight| labels.is_object(sight.instance))),
    ),
];

/// The columns of the table of points.
pub(super) fn columns() -> Vec<Column> {
    let columns = COLUMNS.iter().map(|(name, unit, about, fill)| Column {
        name: (*name).to_owned(),
        kind: match fill {
            Fill::Int(kind, _) => *kind,
            Fill::Float(_) => Kind::Float,
            Fill::Bool(_) => Kind::Bool,
        },
        unit,
        about: (*about).to_owned(),
    });
    columns.collect()
}

/// Counts of a scan at the radar itself, in the polarisation that was sent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Counts {
    pub chirps: u32,
    pub hits: u32,
    pub detections: u32,
    /// Chirps whose axis hits an object that is looked for.
    pub threat_chirps: u32,
}

/// The rows of all views of a scan, as columns in their order, and counts.
pub(super) fn rows(
    ready: &ReadyScene,
    scan: u32,
    views: &[View],
    (sights, object_shares): (&[Option<Sight>], &[f32]),
    labels: &Labels,
) -> (Vec<Values>, Counts) {
    let chirps = &ready.scene.chirps;
    let frames = ready.scene.radar().frames();
    let aims_m: Vec<[f64; 2]> = chirps.target_points_m(&frames).map(|aim| aim.to_array()).collect();
    let mut all = Vec::new();
    for view in views {
        let antenna = view.receiver.map_or(0, |receiver| {
            let receivers = &ready.scene.file.receiver;
            1 + receivers.iter().position(|other| other.name == receiver.name).unwrap_or_default()
                as i32
        });
        let mut echoes = view.scan.echoes.iter().peekable();
        for (place, sight) in sights.iter().enumerate() {
            let row = Row {
                scan: scan as i32,
                antenna,
                cross_polar: view.channel == Channel::CrossPolar,
                chirp: chirps.number[place],
                aim_m: aims_m[place],
                detected: false,
                echo: None,
                sight: sight.as_ref(),
                object_share: object_shares[place],
            };
            let before = all.len();
            while let Some(echo) = echoes.next_if(|echo| echo.chirp == row.chirp) {
                let detected = echo.power_w >= view.scan.threshold_w;
                all.push(Row { detected, echo: Some(echo), ..row });
            }
            if all.len() == before {
                all.push(row);
            }
        }
    }
    let own = all.iter().filter(|row| row.antenna == 0 && !row.cross_polar);
    let mut counts = Counts { chirps: sights.len() as u32, ..Counts::default() };
    counts.hits = sights.iter().flatten().count() as u32;
    counts.detections = own.filter(|row| row.detected).count() as u32;
    let on_object = sights.iter().flatten().filter(|sight| labels.is_object(sight.instance));
    counts.threat_chirps = on_object.count() as u32;
    let columns = COLUMNS.iter().map(|(.., fill)| match fill {
        Fill::Int(_, value) => Values::Ints(all.iter().map(|row| value(row, labels)).collect()),
        Fill::Float(value) => Values::Floats(all.iter().map(value).collect()),
        Fill::Bool(value) => Values::Bools(all.iter().map(|row| value(row, labels)).collect()),
    });
    (columns.collect(), counts)
}
