//! `matdb plot`.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::console::Console;
use crate::catalogue::{Spectrum, spectra};
use crate::error::Error;
use crate::files::{folder_of, write_all};
use crate::formats::figure::Plot;
use crate::report::{
    FigureFormat, appendix_figures, drawn_words, incidence_plot, material_plot, sweep_plot,
};
use crate::setup::{Database, MaterialRevision, find_material};

/// Draw how a material scatters, and what its parameters do
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb plot mannequin-paint -o paint.svg
  matdb plot mannequin-paint --sweep specular.m=0.01,0.05,0.1 -o sweep.png
  matdb plot pvdf --permittivity -o pvdf.svg    the permittivity over frequency
  matdb plot --appendix -o figures          figures 16 to 19 of the paper, as PNG and SVG")]
#[command(group = clap::ArgGroup::new("what").required(true))]
pub(super) struct Args {
    /// NAME or NAME@REVISION
    #[arg(group = "what")]
    material: Option<String>,
    /// Figures 16 to 19 of the paper: what f_lambda, m, r_s and alpha do
    #[arg(long, group = "what")]
    appendix: bool,
    /// Draw the fit for several values of one parameter
    #[arg(long, value_name = "PARAMETER=V1,V2,…", requires = "material")]
    sweep: Option<String>,
    /// Draw the permittivity over frequency, with 95 % bands, instead of the scattering
    #[arg(long, requires = "material", conflicts_with = "sweep")]
    permittivity: bool,
    /// A .svg or .png file; a folder with --appendix
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let written = match &args.material {
        None => {
            let files = appendix_figures()?;
            write_all(&args.output, &files)?;
            files.iter().map(|(name, _)| args.output.join(name).display().to_string()).collect()
        }
        Some(name) if args.permittivity => {
            let store = db.read()?;
            let MaterialRevision { material, .. } = find_material(store.as_ref(), name, "")?;
            let spectra = spectra(&material);
            if spectra.is_empty() {
                let what = format!("`{name}` has no permittivity at three or more frequencies");
                let way_out =
                    "`matdb show` prints those that it has; state more as [[permittivity]]";
                return Err(Error::usage(what, way_out));
            }
            write_plot(&args.output, &Spectrum::plot(&material.name, "", &spectra))?
        }
        Some(name) => {
            let store = db.read()?;
            let MaterialRevision { material, .. } = find_material(store.as_ref(), name, "")?;
            let series = match &args.sweep {
                None => material_plot(&material)?,
                Some(sweep) => sweep_plot(&material, sweep)?,
            };
            let kind = material.render_kind().map_or("of unknown origin", |kind| kind.as_str());
            let kind = material.rendered_words().unwrap_or_else(|| kind.to_owned());
            let kind = [Some(kind), drawn_words(&material)?].into_iter().flatten();
            let kind = kind.collect::<Vec<String>>().join(", ");
            write_plot(&args.output, &incidence_plot(&material.name, &kind, series))?
        }
    };
    let text = format!("wrote {}\n", written.join(", "));
    console.result(&text, &json!({ "files": written }))
}

/// Writes a plot to a file whose ending says how; the path of it.
pub(super) fn write_plot(path: &Path, plot: &Plot) -> Result<Vec<String>, Error> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let bytes = FigureFormat::of(path)?.encode(plot)?;
    write_all(folder_of(path), &[(&name, bytes)])?;
    Ok(vec![path.display().to_string()])
}
