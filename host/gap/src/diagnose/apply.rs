//! The loop closes: the axis file with the simulator's own parameters as refitted, and the named effects in it.

use super::Outcome;
use super::axis_at::entries;
use super::hypothesis::Hypothesis;
use super::verdict::Kind;
use crate::axis_file::AxisFile;
use crate::inverse::Owner;

/// An axis file that simulates better, and where its numbers come from.
#[derive(Clone, Debug)]
pub struct Applied {
    /// The file.
    pub axis: AxisFile,
    /// What it rests on, a line each, for its head.
    pub provenance: Vec<String>,
}

impl Outcome {
    /// What is to be simulated from here on: the named effects, of several tied ones the most probable, or else the
    /// refitted simulator alone.
    pub fn best(&self) -> &Hypothesis {
        match self.verdict.named.first() {
            Some(&place) => &self.verdict.ranked[place].0,
            None => &self.search.base,
        }
    }

    /// The axis file with the best hypothesis in it.
    pub fn applied(&self, axis: &AxisFile) -> Applied {
        let best = self.best();
        let mut provenance = vec![format!(
            "logs: {}",
            self.search
                .records
                .iter()
                .map(|record| record.name.clone())
                .collect::<Vec<_>>()
                .join(", ")
        )];
        for moved in &self.diagnosis.moved {
            provenance.push(format!(
                "{} was {}, standard deviation of the new value {:.2e}",
                moved.parameter, moved.before, moved.deviation
            ));
        }
        if best.added.is_empty() {
            provenance.push("no effect added: the diagnosis names none".to_string());
        } else {
            let gap = &self.diagnosis.gap;
            provenance.push(format!(
                "added {}: gap {:.4e} {} before, {:.4e} after, {:.4e} floor (rms, held out)",
                best.ids().join(", "),
                gap.before,
                gap.unit,
                gap.after,
                gap.floor
            ));
        }
        if self.verdict.kind == Kind::Ambiguous {
            provenance.push(format!(
                "these logs cannot tell apart {}; the most probable one is taken",
                self.diagnosis.verdict.effects.join(", ")
            ));
        }
        let on_one = |free: &&crate::inverse::Free| matches!(free.owner, Owner::OnRecord(..));
        if best.model.free.iter().any(|free| on_one(&free)) {
            provenance.push("phases over time are those of the first log".to_string());
        }
        Applied {
            axis: axis_file(axis, best),
            provenance,
        }
    }
}

/// The axis file of a fitted hypothesis, on the clock of the first record.
pub fn axis_file(given: &AxisFile, hypothesis: &Hypothesis) -> AxisFile {
    let point = hypothesis.model.at(&hypothesis.fit.at);
    let believed = point.believed();
    let mut file = given.clone();
    file.axis.inertia = believed.inertia_kg_m2;
    if let Some(load) = believed.load {
        file.axis.load_inertia = Some(load.inertia_kg_m2);
        file.axis.coupling_stiffness = Some(load.stiffness_nm_rad);
    }
    let friction = &mut file.friction;
    friction.model = Some(believed.model);
    friction.coulomb = Some(believed.coulomb_nm);
    // Rounding must not bring it below Coulomb friction.
    friction.stiction = Some(believed.stiction_nm.max(believed.coulomb_nm));
    friction.stribeck_velocity = Some(believed.stribeck_velocity_rad_s);
    friction.stiffness = Some(believed.stiffness_nm_rad);
    friction.damping = Some(believed.damping_nm_s_rad);
    friction.viscous = Some(believed.viscous_nm_s_rad);
    friction.breakaway_ratio = Some(believed.breakaway_ratio);
    if believed.drive.lag_s > 0.0 {
        file.drive.lag_s = Some(believed.drive.lag_s);
    }
    file.effects = entries(&point, 0, given.unit);
    file
}
