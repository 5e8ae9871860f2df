//! The findings on a fit, with their sentences.

use std::fmt;

use serde::Serialize;

use super::minimise::Stop;
use crate::brdf::Excess;
use crate::formats::words::{listed, significant};

/// A finding on a fit that limits its use.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "finding", rename_all = "kebab-case")]
pub enum Finding {
    /// Only products of three parameters were found; k was chosen.
    Gauge {
        /// The chosen k.
        k: f64,
    },
    /// The search did not end at an optimum.
    NotConverged {
        /// Why it ended.
        stop: Stop,
    },
    /// Other starts ended elsewhere with a worse cost.
    StartsDisagree {
        /// Number of starts that reached the best fit.
        agreeing: usize,
        /// Number of starts.
        starts: usize,
    },
    /// No detection near normal incidence.
    NoSpecularRows {
        /// Where the specular part ends, degrees.
        below_deg: f64,
    },
    /// No detection away from normal incidence.
    NoDiffuseRows {
        /// Where the diffuse part begins, degrees.
        above_deg: f64,
    },
    /// Censored rows that the method does not use.
    CensoredIgnored {
        /// Number of censored rows.
        censored: usize,
        /// Number of rows.
        rows: usize,
    },
    /// Only detections were recorded, which the method does not know.
    CutIgnored,
    /// The levels of the curve are known up to a common factor only.
    Relative,
    /// A number stopped at a bound of its range.
    AtBound {
        /// Its name.
        name: String,
        /// The bound.
        value: f64,
    },
    /// The data determine only a combination of several numbers.
    OnlyTogether {
        /// Names of these numbers.
        names: Vec<String>,
    },
    /// The data do not determine a number.
    Unconstrained {
        /// Its name.
        name: String,
    },
    /// Two numbers that could replace each other.
    HardToTellApart {
        /// Their names.
        names: [String; 2],
        /// Their correlation.
        correlation: f64,
    },
    /// An interval ends at a bound of the range, before the data reject the number.
    OpenInterval {
        /// Name of the number.
        name: String,
        /// The bound.
        value: f64,
    },
    /// The fitted model is outside its own range.
    OutOfRange {
        /// The parameter that would be out of range, and its value.
        problem: String,
        /// The fixed parameters.
        held: Vec<String>,
    },
    /// The width of a lobe is within its error of zero: the beam is too wide to see it.
    NotResolved {
        /// Name of the width.
        name: String,
        /// Upper end of its 95 % interval, where the data give one.
        below: Option<f64>,
        /// Divergence of the beam, rad.
        beam_rad: f64,
    },
    /// The fitted model reflects more than it receives.
    TooMuch {
        /// The incidence at which it reflects most, degrees.
        theta_deg: f64,
        /// What it reflects there in all, over what it receives.
        albedo: f64,
    },
    /// Too few detections to test the model.
    FewRows {
        /// Number of detections.
        detected: usize,
        /// Number of fitted numbers.
        unknowns: usize,
    },
    /// The detections scatter about the model by more than a single look of speckle does.
    MoreThanSpeckle {
        /// Fitted looks.
        looks: f64,
    },
    /// Residuals of neighbouring angles are alike.
    NeighboursAlike {
        /// Their correlation.
        correlation: f64,
        /// The correlation that chance exceeds in 1 of 1000 fits.
        limit: f64,
    },
    /// The fitted distribution does not explain the rows.
    PoorFit {
        /// Kolmogorov distance of the residuals from their expected distribution.
        ks_distance: f64,
        /// The distance that chance exceeds in 1 % of all fits.
        limit: f64,
    },
}

impl Finding {
    /// Whether the data leave the curve of the model undetermined at some angle, and not only its numbers.
    pub fn leaves_the_curve_open(&self) -> bool {
        match self {
            Finding::NoDiffuseRows { .. } | Finding::Unconstrained { .. } => true,
            // A diffuse lobe without an exponent is Lambert's: a law like any other.
            Finding::OpenInterval { name, value } => *value != 0.0 || !name.ends_with("alpha"),
            _ => false,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Finding::Gauge { k } => write!(
                f,
                "backscatter sees f_lambda and k only as S = (1 - k) f_lambda, r_s and k only as \
                 R = k r_s, both up to the calibration; k = {} was chosen",
                significant(*k, 5)
            ),
            Finding::NotConverged { stop } => {
                let why = match stop {
                    Stop::StartsDisagree => "other starts ended at worse fits",
                    Stop::Iterations => "the iterations ran out",
                    Stop::NotFinite => "the cost has no number",
                    _ => "no step improves although one should",
                };
                write!(f, "the search failed and did not converge: {why}; do not use the numbers")
            }
            Finding::StartsDisagree { agreeing, starts } => write!(
                f,
                "{agreeing} of {starts} starts reached the best fit; other fits are nearly as good or \
                 the search is hard"
            ),
            Finding::NoSpecularRows { below_deg } => write!(
                f,
                "no detection below {} degrees: of the specular part the data show the flank at most",
                significant(*below_deg, 5)
            ),
            Finding::NoDiffuseRows { above_deg } => write!(
                f,
                "no detection above {} degrees: the data do not show the diffuse part",
                significant(*above_deg, 5)
            ),
            Finding::CensoredIgnored { censored, rows } => write!(
                f,
                "{censored} of {rows} rows are below the threshold and least squares ignores them, which \
                 flattens the tail; and it takes the mean of decibels, which speckle pulls down"
            ),
            Finding::CutIgnored => write!(
                f,
                "only detections were recorded, and least squares takes the cut at the threshold for the surface's law; \
                 use the method censored"
            ),
            Finding::Relative => write!(
                f,
                "the levels are relative: R, S and every other level count in an unknown unit; their ratios, widths and \
                 exponents are the surface's"
            ),
            Finding::AtBound { name, value } => {
                write!(f, "{name} stopped at its bound {}", significant(*value, 5))
            }
            Finding::OnlyTogether { names } => {
                write!(
                    f,
                    "{} act only together: the data determine their combination",
                    listed(names)
                )
            }
            Finding::Unconstrained { name } => write!(f, "the data say nothing of {name}"),
            Finding::HardToTellApart { names: [a, b], correlation } => {
                write!(f, "{a} and {b} are hard to tell apart: correlation {correlation:.3}")
            }
            Finding::OpenInterval { name, value } => {
                write!(
                    f,
                    "the data do not limit {name} before its bound {}",
                    significant(*value, 5)
                )
            }
            Finding::OutOfRange { problem, held } => {
                write!(f, "no parameters in their ranges give this level: {problem}; ")?;
                if !held.is_empty() {
                    write!(f, "let go of {}, or ", listed(held))?;
                }
                write!(f, "check the calibration of the radar")
            }
            Finding::NotResolved { name, below, beam_rad } => {
                write!(f, "{name} is not resolved by this radar: it is within its error of zero")?;
                if let Some(below) = below {
                    write!(f, ", below {}", significant(*below, 2))?;
                }
                write!(f, ", where the beam has a divergence of {} rad", significant(*beam_rad, 3))
            }
            Finding::TooMuch { theta_deg, albedo } => {
                let excess = Excess { theta_rad: theta_deg.to_radians(), albedo: *albedo };
                write!(f, "the model {}; nothing is cut off", excess.words())
            }
            Finding::FewRows { detected, unknowns } => write!(
                f,
                "{detected} detected levels are too few to test a model with {unknowns} numbers: the \
                 intervals hold only if the model is right"
            ),
            Finding::MoreThanSpeckle { looks } => write!(
                f,
                "the levels scatter by more than one look of speckle does (looks = {}): the model or the \
                 levels are off, which the intervals do not include",
                significant(*looks, 2)
            ),
            Finding::NeighboursAlike { correlation, limit } => write!(
                f,
                "neighbouring angles are off alike (correlation {correlation:.2}, chance explains {limit:.2}): the form of \
                 the law is off there, or neighbours share their speckle, and the intervals include neither"
            ),
            Finding::PoorFit { ks_distance, limit } => write!(
                f,
                "the model does not explain the data: the residuals are {ks_distance:.3} away from \
                 their law, chance explains {limit:.3}"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diffuse_lobe_that_may_be_lamberts_leaves_no_curve_open() {
        let open = |name: &str, value| {
            Finding::OpenInterval { name: name.to_owned(), value }.leaves_the_curve_open()
        };
        assert!(!open("diffuse.alpha", 0.0));
        assert!(open("diffuse.alpha", 1000.0) && open("R", 0.0));
    }

    #[test]
    fn findings_are_sentences_about_named_things() {
        let names = ["k", "specular.f_lambda", "diffuse.r_s"].map(str::to_owned).to_vec();
        let text = Finding::OnlyTogether { names }.to_string();
        assert!(
            text.starts_with("k, specular.f_lambda and diffuse.r_s act only together"),
            "{text}"
        );
        let text = Finding::AtBound { name: "specular.m".to_owned(), value: 2.0 }.to_string();
        assert_eq!(text, "specular.m stopped at its bound 2");
    }
}
