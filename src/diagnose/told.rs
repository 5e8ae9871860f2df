//! Which unknowns the data tell where facets move under the rays.
//!
//! ln p then changes by steps, and its slopes over one width seem to tell how a ball is turned. Slopes over another width do not
//! share those steps: along a direction that the data do tell, the products of both are those of one. An unknown with
//! a part in another direction is told no better than that direction is, which is not at all.

use nalgebra::DMatrix;

/// Share of the products of one width that those of both must keep along a direction which the data tell.
const KEPT: f64 = 1.0 / 9.0;
/// Share of the variance of an unknown that may lie along other directions, as one width tells them.
const UNTOLD: f64 = 0.2;
/// Deviations at which ln p is looked at. Nearer, steps of ln p hide how it falls.
const TESTED: f64 = 6.0;
/// Share of the fall of a normal distribution that ln p must have there.
const FALLEN: f64 = 0.5;
/// Its fall at [`TESTED`] deviations.
pub(super) const LEAST_FALL: f64 = FALLEN * 0.5 * TESTED * TESTED;
/// Least eigenvalue of the scaled products of a direction that one width tells.
const LEAST: f64 = 1e-6;

/// Standard deviations from the products of the scores, by slopes of one width and of two; none for an unknown that the data
/// do not tell.
pub(super) fn deviations(one: &DMatrix<f64>, both: &DMatrix<f64>) -> Vec<Option<f64>> {
    let scale: Vec<f64> = one.diagonal().iter().map(|bend| bend.max(0.0).sqrt()).collect();
    let bent: Vec<usize> = (0..scale.len()).filter(|&k| scale[k] > 0.0).collect();
    let scaled = |products: &DMatrix<f64>| {
        DMatrix::from_fn(bent.len(), bent.len(), |a, b| {
            let (a, b) = (bent[a], bent[b]);
            0.5 * (products[(a, b)] + products[(b, a)]) / (scale[a] * scale[b])
        })
    };
    let (of_one, of_both) = (scaled(one).symmetric_eigen(), scaled(both));
    let seen: Vec<usize> = (0..bent.len()).filter(|&k| of_one.eigenvalues[k] > LEAST).collect();
    // Directions along which the products of one width are 1.
    let whitening = DMatrix::from_fn(bent.len(), seen.len(), |row, column| {
        let k = seen[column];
        of_one.eigenvectors[(row, k)] / of_one.eigenvalues[k].sqrt()
    });
    let kept = (whitening.transpose() * of_both * &whitening).symmetric_eigen();
    let directions = whitening * &kept.eigenvectors;
    let mut deviations = vec![None; scale.len()];
    for (place, &k) in bent.iter().enumerate() {
        let hidden = (0..bent.len()).filter(|k| !seen.contains(k));
        let mut untold: f64 = hidden.map(|k| of_one.eigenvectors[(place, k)].powi(2) / LEAST).sum();
        let mut variance = 0.0;
        for (part, share) in directions.row(place).iter().zip(&kept.eigenvalues) {
            if *share > KEPT {
                variance += part * part / share.min(1.0);
            } else {
                untold += part * part;
            }
        }
        if untold <= UNTOLD * variance {
            // A small part along another direction counts as if that were told by the least that is.
            deviations[k] = Some((variance + untold / KEPT).sqrt() / scale[k]);
        }
    }
    deviations
}

/// A standard deviation, widened until ln p falls as it promises at [`TESTED`] of it on either side, or at `most` if that is
/// nearer; none where it does not. `fall` is that of ln p at a distance, with all other unknowns where they are likeliest.
pub(super) fn widened(mut sd: f64, most: f64, mut fall: impl FnMut(f64) -> f64) -> Option<f64> {
    loop {
        let away = most.min(TESTED * sd);
        let least = FALLEN * 0.5 * (away / sd).powi(2);
        let mut is_held = |side: f64| fall(side * away) >= least;
        if is_held(1.0) && is_held(-1.0) {
            return Some(sd);
        }
        if away >= most {
            return None;
        }
        sd *= 2.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_both_widths_share_is_told() {
        let one = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 100.0]);
        let found = deviations(&one, &one);
        assert!((found[0].unwrap() - 0.5).abs() < 1e-12 && (found[1].unwrap() - 0.1).abs() < 1e-12);
        let found = deviations(&one, &(0.25 * &one));
        assert!((found[0].unwrap() - 1.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn a_shift_that_makes_up_for_an_untold_turn_is_not_told_either() {
        // A ball that turns about a point beside its centre: steps of its facets tell the turn by one width alone, and what is
        // told is the shift of the centre, x + turn.
        let of_centre =
            DMatrix::from_row_slice(3, 3, &[9.0, 9.0, 0.0, 9.0, 9.0, 0.0, 0.0, 0.0, 4.0]);
        let mut one = of_centre.clone();
        one[(1, 1)] += 25.0;
        let found = deviations(&one, &of_centre);
        assert_eq!(found[..2], [None, None]);
        assert!((found[2].unwrap() - 0.5).abs() < 1e-9);
        // Where the turn is told, so is the shift.
        assert!(deviations(&one, &one).iter().all(Option::is_some));
    }

    #[test]
    fn an_unknown_without_slopes_is_not_told() {
        let one = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 0.0]);
        assert_eq!(deviations(&one, &one), [Some(0.5), None]);
        // Nor is one that only acts together with another.
        let same = DMatrix::from_element(2, 2, 3.0);
        assert_eq!(deviations(&same, &same), [None, None]);
    }

    #[test]
    fn a_deviation_grows_until_ln_p_falls_as_it_says() {
        let normal = |by: f64| 0.5 * (by / 0.3).powi(2);
        assert_eq!(widened(0.3, 10.0, normal), Some(0.3));
        // Within a factor of √2, as half the fall is enough.
        let found = widened(0.01, 10.0, normal).unwrap();
        assert!((0.21..0.43).contains(&found), "{found}");
        // Wide ones are looked at as far as one goes.
        assert_eq!(widened(3.0, 10.0, |by| 0.5 * (by / 3.0).powi(2)), Some(3.0));
        assert_eq!(widened(3.0, 10.0, |by| 0.5 * (by / 9.0).powi(2)), None);
        // Steps beside the maximum do not hold what the far side does not, and one side is not enough.
        assert_eq!(
            widened(0.01, 10.0, |by| if by.abs() > 1.0 { 3.0 } else { 4.0 * by.abs() }),
            None
        );
        assert_eq!(widened(0.01, 10.0, |by| if by > 0.0 { 1e3 } else { 1.0 }), None);
    }
}
