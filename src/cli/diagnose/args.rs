//! Flags of `matdb diagnose`.

use std::path::PathBuf;

use crate::cli::cloud::{CloudArgs, ColumnArgs};

/// Find the physical effect that a model lacks to explain a measurement
#[derive(Debug, clap::Args)]
#[command(mut_arg("cloud", |cloud| cloud.required(false).index(1)))]
#[command(mut_args(of_clouds))]
#[command(after_help = "Examples:
  matdb diagnose cloud.ply --scene scene.toml -o diagnosis
  matdb diagnose cloud.ply --scene scene.toml --effects drift,fov-gain -o diagnosis
  matdb diagnose cloud.ply --scene scene.toml -o diagnosis --add    store what is found
  matdb diagnose a.ply b.ply --scene a.toml --scene b.toml -o diagnosis    one target, two poses
  matdb diagnose --curve coating.csv -o diagnosis
  matdb effects                             what is tried, and its signature

Writes report.html (for a person), report.json, residuals.csv (one line per chirp), pictures (.svg and \
.png), and after.toml, the scene with what was found. With too few data, only report.html and \
report.json are written, and the status is not 0.")]
pub struct Args {
    #[command(flatten)]
    pub cloud: Option<CloudArgs>,
    #[command(flatten)]
    pub columns: ColumnArgs,
    /// Further clouds of the same target: of another pose or antenna, or repeats. One joint answer is found
    #[arg(value_name = "CLOUD", index = 2, conflicts_with = "curve")]
    pub further: Vec<PathBuf>,
    /// The scene that was measured: its mesh, materials, radar and scan. One for each cloud in the same order, or
    /// one for all
    #[arg(long, value_name = "SCENE")]
    pub scene: Vec<PathBuf>,
    /// The receiver of the scene that the cloud is of, as in cloud-NAME.ply [default: the radar itself]
    #[arg(long, value_name = "NAME", conflicts_with = "curve")]
    pub receiver: Option<String>,
    /// Instead of a cloud: a backscatter curve (.csv of `matdb measure`), a table in the plane of
    /// incidence (.csv: theta_i_deg,theta_s_deg,brdf_per_sr) or a .bsdf
    #[arg(long, value_name = "FILE")]
    pub curve: Option<PathBuf>,
    /// Law that a curve is compared with [default: one GGX lobe over Lambert]
    #[arg(long, value_name = "MODEL", requires = "curve")]
    pub model: Option<String>,
    /// Noise of a curve's levels, dB [default: from repeats, the file, or neighbouring angles]
    #[arg(long, value_name = "DB", requires = "curve", allow_negative_numbers = true)]
    pub noise_db: Option<f64>,
    /// Try only these effects [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub effects: Vec<String>,
    /// Store what was found, and what was tried and not found, as new revisions of the materials, and a
    /// changed scene as SCENE-after.toml
    #[arg(long, conflicts_with = "curve")]
    pub add: bool,
    /// The only material to store the findings in [default: all of the scene with enough chirps]
    #[arg(long, value_name = "NAME", conflicts_with = "curve")]
    pub material: Option<String>,
    /// Seed of folds and of everything random
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    pub seed: u64,
    /// Leave out the controls: what meaningless terms gain, and the size from which on each effect would have been found.
    /// They change no answer and take about a third of the time
    #[arg(long, conflicts_with = "curve")]
    pub no_controls: bool,
    /// Folder to write; created if needed
    #[arg(long, short, value_name = "DIR")]
    pub output: PathBuf,
}

/// Refuses flags that a curve has no use for.
fn of_clouds(flag: clap::Arg) -> clap::Arg {
    if ["unit", "power", "frame"].contains(&flag.get_id().as_str()) {
        flag.conflicts_with("curve")
    } else {
        flag
    }
}
