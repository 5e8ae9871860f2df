//! What a curve lacks: nothing, another scattering model, terms, or something unknown.

use super::evidence::RankedTerm;
use super::goodness::goodness;
use super::isolated::isolated;
use super::points::Points;
use super::remains;
use super::report::{ComparedLaw, CurveUnknown};
use super::select::{Addition, FAR_BETTER, Selection, State};
use super::terms::Term;
use super::trust::{NameDoubt, doubts};

/// Name of the model that was asked for.
pub(super) const DECLARED: &str = "declared";
/// Other models to which terms are added, the likeliest first.
const MOST_OTHERS: usize = 1;

/// A scattering model that was fitted to the curve, and what it leaves.
pub(super) struct Compared {
    pub name: &'static str,
    pub state: State,
    left: Vec<CurveUnknown>,
}

impl Compared {
    pub fn new(selection: &Selection, name: &'static str, state: State) -> Compared {
        let left = remains::unexplained(selection, &state);
        Compared { name, state, left }
    }

    /// Whether no test of what remains finds anything.
    pub fn explains(&self) -> bool {
        self.left.is_empty()
    }

    pub fn in_report(&self, points: &Points) -> ComparedLaw {
        let State { model, fitted, .. } = &self.state;
        let levels_db = model.levels_db(&fitted.at, &points.points);
        let residual_db = points.detected_residuals_db(&levels_db);
        let square_db2: f64 = residual_db.iter().map(|residual_db| residual_db.powi(2)).sum();
        ComparedLaw {
            name: self.name,
            rms_db: (square_db2 / residual_db.len().max(1) as f64).sqrt(),
            numbers: model.unknowns(),
            p_value: goodness(points, &self.state),
            explains: self.explains(),
        }
    }
}

/// Models in the order of Schwarz's criterion.
fn likeliest_first(compared: &[Compared]) -> Vec<&Compared> {
    let mut all: Vec<&Compared> = compared.iter().collect();
    all.sort_by(|a, b| {
        let [a, b] = [a, b].map(|one| one.state.fitted.criterion());
        a.total_cmp(&b)
    });
    all
}

/// The answer.
pub(super) struct Answer {
    /// Name of the scattering model.
    pub law: &'static str,
    /// That model with the terms.
    pub after: State,
    pub ranking: Vec<RankedTerm>,
    pub added: Vec<Addition>,
    pub may_be: Vec<&'static str>,
    pub doubts: Vec<NameDoubt>,
    pub unexplained: Vec<CurveUnknown>,
    /// Schwarz's criterion where no more than noise remains with the terms, be they trusted or not; else infinite.
    explains_at: f64,
}

impl Answer {
    /// The first of these that leaves no more than noise: the declared model, one of the others, the declared model with
    /// terms. The last comes before one of the others where it has an effect that is no lobe and is far better: terms that
    /// make the declared model the other one are no better. It is no answer where one of the others does better with terms.
    /// Where a model explains all but a few isolated levels, terms are not tried.
    pub fn of(selection: &Selection, compared: &[Compared], terms: &[&'static dyn Term]) -> Answer {
        let (declared, others) = compared.split_at(1);
        let declared = &declared[0];
        if declared.explains() {
            return Answer::without_terms(declared, Vec::new());
        }
        let others = likeliest_first(others);
        if let Some(best) = others.iter().find(|one| one.explains()) {
            let other = Answer::without_terms(best, Vec::new());
            if !selection.points.has_known_noise() {
                return other;
            }
            let with = Answer::with_terms(selection, declared, terms);
            let least = best.state.fitted.criterion() - FAR_BETTER;
            let is_effect = with.added.iter().any(|one| !one.term.is_shape());
            let is_far_better =
                is_effect && with.unexplained.is_empty() && with.after.fitted.criterion() < least;
            return if is_far_better { with } else { other };
        }
        for one in likeliest_first(compared) {
            if let Some((isolated, fitted)) = isolated(selection, &one.state) {
                let answer = Answer::without_terms(one, vec![isolated]);
                return Answer { after: State { fitted, ..answer.after }, ..answer };
            }
        }
        let bases = [declared].into_iter().chain(others.into_iter().take(MOST_OTHERS));
        let mut found: Vec<Answer> =
            bases.map(|one| Answer::with_terms(selection, one, terms)).collect();
        let is_first = found.iter().all(|one| one.explains_at >= found[0].explains_at);
        if found[0].unexplained.is_empty() && is_first {
            return found.swap_remove(0);
        }
        // What improves a model and leaves more than noise may stand for something else, and an effect beside another law
        // for a law that is wrong as well.
        let mut answer = Answer::without_terms(declared, declared.left.clone());
        for one in found {
            if !one.added.is_empty() {
                answer.doubts.push(match one.law {
                    _ if !one.unexplained.is_empty() => NameDoubt::MoreRemains,
                    DECLARED => NameDoubt::OtherBetter,
                    _ => NameDoubt::BesideLaw,
                });
            }
            answer.may_be.extend(one.added.iter().flat_map(Addition::names));
            answer.may_be.extend(one.may_be);
            answer.doubts.extend(one.doubts);
            answer.ranking.extend(one.ranking);
        }
        answer.may_be.sort_unstable();
        answer.may_be.dedup();
        answer.doubts.sort_unstable();
        answer.doubts.dedup();
        answer.ranking.iter_mut().for_each(|one| one.accepted = false);
        answer
    }

    fn without_terms(one: &Compared, unexplained: Vec<CurveUnknown>) -> Answer {
        Answer {
            law: one.name,
            after: one.state.clone(),
            ranking: Vec::new(),
            added: Vec::new(),
            may_be: Vec::new(),
            doubts: Vec::new(),
            unexplained,
            explains_at: f64::INFINITY,
        }
    }

    /// A model with the terms that it supports. They get no name where one of them cannot be trusted, where the noise is
    /// unknown, or where an effect stands beside a lobe that makes another law of the model.
    fn with_terms(selection: &Selection, one: &Compared, terms: &[&'static dyn Term]) -> Answer {
        let (after, ranking, added) = selection.run(one.name, one.state.clone(), terms);
        let unexplained = remains::unexplained(selection, &after);
        let explains_at =
            if unexplained.is_empty() { after.fitted.criterion() } else { f64::INFINITY };
        let least_db = selection.settings.least_named_db;
        let doubts = doubts(selection.points, least_db, &one.state, &after, &added);
        if !doubts.is_empty() {
            let may_be = added.iter().flat_map(Addition::names).collect();
            let answer = Answer::without_terms(one, one.left.clone());
            return Answer { ranking, may_be, doubts, explains_at, ..answer };
        }
        Answer {
            law: one.name,
            after,
            ranking,
            added,
            may_be: Vec::new(),
            doubts,
            unexplained,
            explains_at,
        }
    }
}
