//! Measured optical scattering and measured THz constants: what fits and what does not.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

use matdb::brdf::{
    BlinnPhong, Brdf, CookTorrance, Distribution, Fresnel, Lambert, Mixture, Shadowing, Sum,
};
use matdb::fit::bistatic::{Bistatic, Sample};
use matdb::frames::Direction;
use matdb::units::db_from_ratio;
use rayon::prelude::*;

use crate::Failure;

const COATINGS: &str = "ua-loft-black-coatings";
const PTFE: &str = "nist-ptfe-brdf/PTFE.data.csv";
const CONSTANTS: &str = "thz-optical-constants/summary_300GHz.csv";
/// Backscatter nearer than this is behind the detector's own shadow, degrees.
const BLOCKED_DEG: f64 = 4.9;
/// Stray light is not known better, 1/sr.
const DARK_PER_SR: f64 = 1e-3;

type Record = BTreeMap<String, String>;

/// One measured set: samples and how well a repeat agrees.
struct Measured {
    name: String,
    samples: Vec<Sample>,
    left_out: usize,
    repeat_db: Option<f64>,
}

/// The section of the page.
pub fn section(folder: &Path) -> Result<String, Failure> {
    let coatings = coatings(&folder.join(COATINGS))?;
    let ptfe = ptfe(&folder.join(PTFE))?;
    let mut text = INTRODUCTION.to_owned();
    text += &header();
    for set in coatings.iter().chain(&ptfe) {
        text += &row(set)?;
        eprintln!("{}", set.name);
    }
    text += JUDGEMENT;
    Ok(text + &constants(&folder.join(CONSTANTS))?)
}

const INTRODUCTION: &str = "\
## Measured curves (measured at optical wavelengths, not at 300 GHz)

Two published sets, imported from CSV and not copied into the project:

- Black coatings on metal at 650 nm, LOFT group, University of Arizona, `ua-loft/bsdf-tools` (MIT):
  `ua-loft-black-coatings/samples.csv` and `blanks.csv`. f = (rt − blank)/(π·cos θ_r), mean of the repeats. Aeroglaze is
  scanned in the plane of incidence, the others over the hemisphere; incidences 10°, 30°, 50°, 70°.
- Sintered PTFE at 633 nm, T. A. Germer, NIST, Applied Optics (2017): `nist-ptfe-brdf/PTFE.data.csv`, column `f_r11`.

They are bistatic, so `fit::bistatic` fits them: least squares in dB over all pairs of directions, without speckle and threshold. Left out are
directions within 4.9° of backscatter, where the detector blocks the beam and the reading drops to nothing, and values below 0.001/sr, which
may be stray light. *Repeat* is the rms scatter of one repeat about the true mean: the residual of a model that explains the surface.
";

const JUDGEMENT: &str = "
No model reaches the repeat where there is one; the remaining error is the models' own, so no intervals are given. PTFE is Lambertian within
0.25 dB up to 60°: the lobe that the fits add there is the broad rise of a volume scatterer, not a facet lobe. The fits show how
flexible the models are; their numbers do not hold at 300 GHz.
";

fn header() -> String {
    let of_model =
        |(name, start): &(&str, Brdf)| format!(" {name}, {} |", start.parameters().len());
    let models: String = models().iter().map(of_model).collect();
    format!(
        "
Residual rms in dB, by model and number of free parameters; in brackets the starts that agree, where not all do:

| set | directions | left out | repeat |{models}
|---|{}
",
        "--:|".repeat(3 + self::models().len())
    )
}

fn row(set: &Measured) -> Result<String, Failure> {
    let repeat = set.repeat_db.map_or("–".to_owned(), |db| format!("{db:.2}"));
    let mut text =
        format!("| {} | {} | {} | {repeat} |", set.name, set.samples.len(), set.left_out);
    let bistatic = Bistatic::default();
    let fits: Vec<_> =
        models().into_par_iter().map(|(_, start)| bistatic.run(&start, &set.samples)).collect();
    for found in fits {
        let found = found?;
        text += &format!(" {:.2}", found.rms_db);
        if found.agreeing_starts < bistatic.starts {
            text += &format!(" ({} of {})", found.agreeing_starts, bistatic.starts);
        }
        text += if found.converged { " |" } else { " (not converged) |" };
    }
    Ok(text + "\n")
}

fn models() -> Vec<(&'static str, Brdf)> {
    let lambert = || Brdf::Lambert(Lambert { albedo: 0.1 });
    let lobe = |distribution, m| {
        let shadowing = Shadowing::Separable;
        Brdf::CookTorrance(CookTorrance {
            f_lambda: 0.05,
            m,
            m_across: None,
            distribution,
            shadowing,
        })
    };
    let sum = |parts| Brdf::Sum(Sum { parts });
    let diffuse = Box::new(Brdf::BlinnPhong(BlinnPhong { r_s: 0.1, alpha: 1.0 }));
    let paper = Mixture { k: 0.5, diffuse, specular: Box::new(lobe(Distribution::Beckmann, 0.3)) };
    let mirror = Fresnel { eps_real: 2.5, eps_imag: 0.0, lobe_rad: Some(0.3) };
    use Distribution::{Beckmann, Ggx};
    vec![
        ("Lambert", lambert()),
        ("Lambert + Beckmann lobe", sum(vec![lambert(), lobe(Beckmann, 0.3)])),
        ("Lambert + GGX lobe", sum(vec![lambert(), lobe(Ggx, 0.3)])),
        ("Lambert + Fresnel's mirror lobe", sum(vec![lambert(), Brdf::Fresnel(mirror)])),
        ("the paper's mixture", Brdf::Mixture(paper)),
        ("Lambert + two GGX lobes", sum(vec![lambert(), lobe(Ggx, 0.15), lobe(Ggx, 0.6)])),
    ]
}

/// One scan point: scan, azimuth, incidence and receiver angle.
type Place = [String; 4];

fn coatings(folder: &Path) -> Result<Vec<Measured>, Failure> {
    let place = |r: &Record| -> Place {
        ["scan", "azimuth_deg", "incidence_deg", "receive_deg"].map(|name| r[name].clone())
    };
    let mut blanks: BTreeMap<Place, f64> = BTreeMap::new();
    for record in records(&folder.join("blanks.csv"))? {
        blanks.insert(place(&record), number(&record, "rt")?);
    }
    let mut sets: BTreeMap<String, BTreeMap<Place, Vec<f64>>> = BTreeMap::new();
    for record in records(&folder.join("samples.csv"))? {
        let place = place(&record);
        let blank = blanks.get(&place).ok_or("a sample without a blank")?;
        let cos = number(&record, "receive_deg")?.to_radians().cos();
        let f_per_sr = (number(&record, "rt")? - blank) / (PI * cos);
        sets.entry(record["sample"].clone()).or_default().entry(place).or_default().push(f_per_sr);
    }
    sets.into_iter().map(|(name, places)| coating(&name, &places)).collect()
}

fn coating(name: &str, places: &BTreeMap<Place, Vec<f64>>) -> Result<Measured, Failure> {
    let (mut samples, mut squares) = (Vec::new(), Vec::new());
    for (place, values) in places {
        let [azimuth_deg, incidence_deg, receive_deg] =
            [&place[1], &place[2], &place[3]].map(|text| text.parse::<f64>());
        let (i, o) = directions(azimuth_deg?, incidence_deg?, receive_deg?);
        let count = values.len() as f64;
        let f_per_sr = values.iter().sum::<f64>() / count;
        if is_blocked(i, o) || values.iter().any(|f| *f < DARK_PER_SR) {
            continue;
        }
        let deviation = |f: &f64| db_from_ratio(f / f_per_sr).powi(2);
        let variance = values.iter().map(deviation).sum::<f64>() / (count - 1.0).max(1.0);
        squares.push(variance);
        samples.push(Sample { i, o, f_per_sr });
    }
    let repeats = places.values().any(|values| values.len() > 1);
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    let left_out = places.len() - samples.len();
    let repeat_db = repeats.then(|| mean.sqrt());
    Ok(Measured { name: format!("`{name}`"), samples, left_out, repeat_db })
}

/// At azimuth −90° the receiver is in the plane of incidence, mirror-wards where positive.
fn directions(
    azimuth_deg: f64,
    incidence_deg: f64,
    receive_deg: f64,
) -> (Direction<matdb::frames::Surface>, Direction<matdb::frames::Surface>) {
    let side = if receive_deg < 0.0 { PI } else { 0.0 };
    let azimuth_rad = (azimuth_deg + 90.0).to_radians() + side;
    let i = Direction::from_angles(incidence_deg.to_radians(), PI);
    (i, Direction::from_angles(receive_deg.abs().to_radians(), azimuth_rad))
}

fn is_blocked(i: Direction<matdb::frames::Surface>, o: Direction<matdb::frames::Surface>) -> bool {
    i.xyz().dot(o.xyz()) > BLOCKED_DEG.to_radians().cos()
}

fn ptfe(path: &Path) -> Result<Vec<Measured>, Failure> {
    let records = records(path)?;
    let set = |name: &str, least_deg: f64, most_deg: f64| -> Result<Measured, Failure> {
        let (mut samples, mut left_out) = (Vec::new(), 0);
        for record in records.iter().filter(|record| record["lambda"] == "0.633") {
            let incidence_deg = number(record, "thetai")?.abs();
            if !(least_deg..=most_deg).contains(&incidence_deg) {
                continue;
            }
            let i = Direction::from_angles(incidence_deg.to_radians(), PI);
            let [theta, phi] = [number(record, "thetar")?, number(record, "phir")?];
            let o = Direction::from_angles(theta.to_radians(), phi.to_radians());
            if is_blocked(i, o) {
                left_out += 1;
                continue;
            }
            samples.push(Sample { i, o, f_per_sr: number(record, "f_r11")? });
        }
        Ok(Measured { name: name.to_owned(), samples, left_out, repeat_db: None })
    };
    Ok(vec![
        set("Sintered PTFE, incidence up to 60°", 0.0, 60.0)?,
        set("Sintered PTFE, incidence 75°", 75.0, 75.0)?,
    ])
}

/// Reflectance from measured n and k against the source's own derived number.
fn constants(path: &Path) -> Result<String, Failure> {
    let (mut count, mut largest_db) = (0, 0.0_f64);
    for record in records(path)? {
        let (n, k) = (number(&record, "n_300ghz")?, number(&record, "k_300ghz")?);
        let smooth = Fresnel { eps_real: n * n - k * k, eps_imag: 2.0 * n * k, lobe_rad: None };
        let found_db = db_from_ratio(smooth.reflectance(0.0));
        largest_db = largest_db.max((found_db - number(&record, "normal_reflectance_db")?).abs());
        count += 1;
    }
    Ok(format!(
        "
### Optical constants (measured, 100 GHz to 3 THz)

n and k near 300 GHz of the {count} materials in `thz-optical-constants/summary_300GHz.csv` (refractiveindex.info, CC0; the
references are in the file), as ε = (n − jk)² into `fresnel`; nothing is fitted. What a smooth, thick piece returns at
normal incidence differs from the file's own number by at most {largest_db:.3} dB.
"
    ))
}

fn records(path: &Path) -> Result<Vec<Record>, Failure> {
    let mut reader = csv::Reader::from_path(path)?;
    Ok(reader.deserialize().collect::<Result<_, _>>()?)
}

fn number(record: &Record, column: &str) -> Result<f64, Failure> {
    let text = record.get(column).ok_or_else(|| format!("no column `{column}`"))?;
    Ok(text.trim().parse()?)
}
