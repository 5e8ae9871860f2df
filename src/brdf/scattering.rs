//! The interface of scattering models.

use num_complex::Complex;

use super::backscatter::Term;
use super::lobe::Lobe;
use super::parameter::Visitor;
use super::validity::Condition;
use crate::frames::{Direction, Surface};

/// Anything that scatters. A closure `Fn(i, o) -> f` is one, so a caller's own model needs no type.
///
/// ```
/// use matdb::brdf::Scattering;
/// use matdb::frames::{Direction, Surface};
/// let mine = |i: Direction<Surface>, o: Direction<Surface>| 0.1 * i.cos_theta() * o.cos_theta();
/// assert!((mine.retro_per_sr(0.0) - 0.1).abs() < 1e-15);
/// ```
pub trait Scattering: Sync {
    /// f(i, o), 1/sr: reflected radiance per incident irradiance, equation (9). Both directions lie above
    /// the horizon.
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64;

    /// f(i, o) as a beam of the divergence `beam_rad` (δ, rad, 0 or more) sees it, and how it is made up.
    ///
    /// A lobe is seen convolved with the beam's own, so that a mirror returns at most what it was sent. A model without
    /// a lobe is diffuse and is seen as it is; so are a closure and a measured curve, which includes the beam that it
    /// was measured with. Without a beam, δ = 0, this is [`f_per_sr`](Self::f_per_sr).
    fn seen_by(&self, _beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        Seen::diffuse(self.f_per_sr(i, o))
    }

    /// The share of f(i, o), 0 to 1, that facets reflect like mirrors, rough or not.
    fn specular_share(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).specular_share
    }

    /// The amplitudes r_s and r_p at which the facets that mirror i into o reflect a field across the plane of
    /// incidence and one in it; only their ratio counts. At normal incidence they are equal.
    ///
    /// Those of a perfect conductor unless the model knows its permittivity.
    fn facet_amplitudes(
        &self,
        _i: Direction<Surface>,
        _o: Direction<Surface>,
    ) -> [Complex<f64>; 2] {
        [Complex::from(-1.0); 2]
    }

    /// The lobes in which a surface that is lit from `i` sends power on like a mirror, too narrow for a path to meet by
    /// chance: those with a roughness up to [`NARROW_M`].
    fn narrow_lobes(&self, _i: Direction<Surface>) -> Vec<NarrowLobe> {
        Vec::new()
    }

    /// f(i, o) apart from the narrow lobes.
    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        self.seen_by(0.0, i, o)
    }

    /// f in exact backscatter as a sum of closed forms; `None` for a model whose f depends on the azimuth,
    /// or that has no such sum.
    fn backscatter(&self) -> Option<Vec<Term>> {
        None
    }

    /// f(i, o) as a sum of closed forms, whose narrow lobes are those of facets; `None` for a model that has no such sum.
    fn lobes(&self) -> Option<Vec<Lobe>> {
        None
    }

    /// f in exact backscatter at incidence `theta_rad`, 1/sr.
    fn retro_per_sr(&self, theta_rad: f64) -> f64 {
        let i = Direction::from_angles(theta_rad, 0.0);
        self.f_per_sr(i, i)
    }

    /// Equation (10): differential scattering coefficient σ⁰(θ) = 4π·f(θ)·cos²θ, a pure number.
    fn sigma0(&self, theta_rad: f64) -> f64 {
        4.0 * std::f64::consts::PI * self.retro_per_sr(theta_rad) * theta_rad.cos().powi(2)
    }
}

/// Largest roughness of a lobe that a path follows in the direction of the mirror alone: below the divergence of a
/// beam, which its roughness then joins.
pub const NARROW_M: f64 = 0.01;

/// A lobe about the direction of the mirror.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NarrowLobe {
    /// Share of the power in it, 0 to 1.
    pub share: f64,
    /// Roughness m; 0 for a smooth mirror.
    pub m: f64,
}

/// What a beam sees of a surface in one pair of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// f(i, o), 1/sr.
    pub f_per_sr: f64,
    /// Share of f, 0 to 1, that facets reflect like mirrors, rough or not; the rest is diffuse.
    pub specular_share: f64,
    /// Share of f, 0 to 1, that comes back in one phase from the whole spot, as from a smooth mirror; the rest
    /// comes from scatterers of unknown phases, and speckles.
    pub coherent_share: f64,
}

impl Seen {
    /// A diffuse return, which speckles.
    pub fn diffuse(f_per_sr: f64) -> Seen {
        Seen { f_per_sr, specular_share: 0.0, coherent_share: 0.0 }
    }

    /// The return of a smooth mirror.
    pub fn mirror(f_per_sr: f64) -> Seen {
        Seen { f_per_sr, specular_share: 1.0, coherent_share: 1.0 }
    }

    /// This return and another one, which add up in power.
    pub fn and(self, other: Seen) -> Seen {
        let f_per_sr = self.f_per_sr + other.f_per_sr;
        let share = |own: f64, of_other: f64| {
            if f_per_sr > 0.0 {
                (own * self.f_per_sr + of_other * other.f_per_sr) / f_per_sr
            } else {
                0.0
            }
        };
        Seen {
            f_per_sr,
            specular_share: share(self.specular_share, other.specular_share),
            coherent_share: share(self.coherent_share, other.coherent_share),
        }
    }

    /// The return of facets with a roughness along and across their grain. Of their lobe, which is as wide as the
    /// surface's and the beam's together, the beam's own part δ²/m_eff² is coherent: all of it without
    /// roughness, 5 % at m = 0.05 for δ = 0.0117 rad.
    pub(super) fn facets(f_per_sr: f64, beam_rad: f64, [m_along, m_across]: [f64; 2]) -> Seen {
        let beam2 = beam_rad * beam_rad;
        let widths2 = (m_along * m_along + beam2) * (m_across * m_across + beam2);
        let coherent_share = if widths2 > 0.0 { beam2 / widths2.sqrt() } else { 1.0 };
        Seen { f_per_sr, specular_share: 1.0, coherent_share }
    }
}

impl<F> Scattering for F
where
    F: Fn(Direction<Surface>, Direction<Surface>) -> f64 + Sync,
{
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self(i, o)
    }
}

/// A model with parameters that can be stored; what is special about a kind of model is overridden in its
/// file.
pub trait ScatteringModel: Scattering {
    /// Calls the visitor for every parameter, in a fixed order; `prefix` begins the path of each.
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor);

    /// Whether the surface is smooth: all that it reflects is the lobe of a mirror.
    fn is_smooth(&self) -> bool {
        false
    }

    /// Whether it has a smooth mirror, a delta in direction: f holds it as [`VIEWING_RAD`](super::VIEWING_RAD) wide.
    fn has_smooth_mirror(&self) -> bool {
        false
    }

    /// ε′ and ε″ of the outermost medium, where they are parameters.
    fn permittivity(&self) -> Option<[f64; 2]> {
        None
    }

    /// Reflectivity f_λ of the facets at normal incidence, 0 to 1, where it is a parameter.
    fn f_lambda(&self) -> Option<f64> {
        None
    }

    /// Whether it is a measured curve or has one as a part.
    fn has_curve(&self) -> bool {
        false
    }

    /// Width of its narrowest lobe about the normal as a beam of the divergence `beam_rad` sees it, rad: the tilt at
    /// which the echo has fallen to 1/e; `None` for a model without lobes, or with measured ones.
    fn lobe_rad(&self, beam_rad: f64) -> Option<f64> {
        let terms = self.backscatter().unwrap_or_default();
        let facets = terms.iter().filter_map(|term| term.facets);
        let seen_rad = facets.map(|facets| facets.m_without_beam(beam_rad).hypot(beam_rad));
        seen_rad.min_by(f64::total_cmp)
    }

    /// What its derivation asks of a surface at a wavelength, m; `rms_height_m` is what is known of the surface's
    /// height, for a model without that parameter.
    fn conditions(&self, _wavelength_m: f64, _rms_height_m: Option<f64>) -> Vec<Condition> {
        Vec::new()
    }
}

/// h = (i + o)/|i + o|, the normal of a facet that would mirror i into o.
pub(super) fn half_vector(i: Direction<Surface>, o: Direction<Surface>) -> Direction<Surface> {
    Direction::new(i.xyz() + o.xyz()).unwrap_or(i)
}
