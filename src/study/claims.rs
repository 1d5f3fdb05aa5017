//! Tests of the claims of a university report on photon mapping: each answer is computed from the
//! rows of a figure.

use serde::Serialize;

use super::{Figure, Question, Row, findings};

/// Whether a claim held in this run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The claim held.
    Holds,
    /// The claim did not hold.
    DoesNotHold,
    /// The rows do not suffice to decide.
    Unknown,
}

/// Answer to a question: a claim, the measurement, and whether they agree.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// Question that was asked of the figure.
    pub question: Question,
    /// Claim as one sentence.
    pub claim: &'static str,
    /// Measurement in words.
    pub measured: String,
    /// Result that had to be measured for the claim to hold.
    pub rule: &'static str,
    /// Result of applying the rule to the measurement.
    pub verdict: Verdict,
}

impl Question {
    /// The claim and its acceptance rule.
    fn texts(self) -> (&'static str, &'static str) {
        match self {
            Self::Energy => (
                "The total energy is constant over n and k.",
                "the mean radiance varies by at most 5 % over the figure",
            ),
            Self::GatherDominates => (
                "The gather takes the most of the time.",
                "the gather takes more than half of the total time in every picture of the figure",
            ),
            Self::TimeWithNeighbors => (
                "The time grows with k.",
                "for every n the gather with the largest k takes longer than with the smallest",
            ),
            Self::TimeWithPhotons => (
                "The time grows only with log n.",
                "for every k the gather's time grows by at most twice the ratio of the logarithms of n",
            ),
            Self::Proportion => (
                "n and k should be kept in proportion.",
                "the k of the smallest relMSE never falls as n grows, and is larger for the most photons than for the fewest",
            ),
            Self::NoiseForBias => (
                "A larger k trades noise for bias.",
                "for every n noise falls from the smallest to the largest k, and bias grows from the smallest k at which noise does not hide it",
            ),
            Self::CornersBright => (
                "Corners come out too bright.",
                "with the largest k of each n and mode the pixels near open corners are brighter than the reference's, somewhere by more than 1 %",
            ),
            Self::DirectAgrees => (
                "Photons give the same direct light as shadow rays.",
                "the mean radiance is the same within 5 %, or larger where there are caustics",
            ),
            Self::DeltaShadows => (
                "Shadow rays leave out the light behind mirrors and glass; photons bring it.",
                "direct light by photons is more than 1 % brighter than by shadow rays",
            ),
            Self::ThreeLights => (
                "Three lights give three times the light at the same cost.",
                "three times the mean radiance within a quarter (the picture sees light by where it hangs), in at most 1.25 times the total time",
            ),
        }
    }
}

/// Answers a figure's questions.
pub(super) fn answers(figure: &Figure, rows: &[Row]) -> Vec<Claim> {
    let good: Vec<&Row> = figure.combinations().map(|i| &rows[i]).filter(|row| row.error.is_none()).collect();
    figure.questions.iter().map(|&question| answer(question, &good)).collect()
}

fn answer(question: Question, rows: &[&Row]) -> Claim {
    let found = match question {
        Question::Energy => findings::energy(rows),
        Question::GatherDominates => findings::gather_dominates(rows),
        Question::TimeWithNeighbors => findings::time_with_neighbors(rows),
        Question::TimeWithPhotons => findings::time_with_photons(rows),
        Question::Proportion => findings::proportion(rows),
        Question::NoiseForBias => findings::noise_for_bias(rows),
        Question::CornersBright => findings::corners_bright(rows),
        Question::DirectAgrees => findings::direct_agrees(rows),
        Question::DeltaShadows => findings::delta_shadows(rows),
        Question::ThreeLights => findings::three_lights(rows),
    };
    let (claim, rule) = question.texts();
    let (measured, verdict) = match found {
        Some((text, true)) => (text, Verdict::Holds),
        Some((text, false)) => (text, Verdict::DoesNotHold),
        None => ("not enough was rendered to tell".to_string(), Verdict::Unknown),
    };
    Claim { question, claim, measured, rule, verdict }
}

#[cfg(test)]
#[path = "claims_tests.rs"]
mod tests;
