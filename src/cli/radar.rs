//! `matdb radar`.

use std::path::PathBuf;

use serde_json::json;

use super::console::Console;
use crate::error::Error;
use crate::files::write_all;
use crate::formats::words::significant;
use crate::report::RadarReport;

/// Show a radar: its scan, its spot and the polynomial of equation (1)
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb radar upm-300ghz -o radar
  matdb radar scenes/mannequin.toml -o radar --json

Writes scan.csv, scan.png and scan.svg (where each chirp looks), spot.csv and spot.png (how wide the \
spot is), and f5.toml (the coefficients, to be pasted into a scene).")]
pub(super) struct Args {
    /// A preset's name or a scene file
    radar: String,
    /// Folder to write; created if needed
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let report = RadarReport::open(&args.radar)?;
    let files = report.files()?;
    write_all(&args.output, &files)?;
    let RadarReport { radar, chirps, field, domain, f5_error, .. } = &report;
    chirps.notices.iter().for_each(|notice| console.notice(notice));
    let names = files.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let [width_m, height_m] = field.sides_m();
    let text = format!(
        "{}: {} chirps over {width_m:.3} m × {height_m:.3} m at {} m\n\
         f5 is off the exact mirror by {:.2e} mm at worst, {:.2e} mm rms, for R from {} to {} m\n\
         wrote {names} to {}\n",
        radar.preset,
        chirps.rays.len(),
        significant(radar.frames().pattern_range_m, 3),
        f5_error.worst_mm,
        f5_error.rms_mm,
        domain.range_m[0],
        domain.range_m[1],
        args.output.display()
    );
    let mut value = report.record();
    value["output"] = json!(args.output.to_string_lossy());
    console.result(&text, &value)
}
