//! What a tick saw, what speaks against it, and what of it is usual.

/// What speaks against a tick, a bit each. One number, so that one look tells whether anything does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Alarms(pub(super) u32);

impl Alarms {
    /// The encoder's timer saw both inputs change at once.
    pub const ILLEGAL: Self = Self(1);
    /// The drive does not say that it is well.
    pub const UNWELL: Self = Self(2);
    /// The tick came late, or one before it was lost.
    pub const LATE: Self = Self(4);
    /// The index does not fit the counts.
    pub const INDEX: Self = Self(8);
    /// The step was too large to be motion.
    pub const REJECTED: Self = Self(16);
    /// The supervisor's own: not armed, something stops the torque or has limited it for too long, or the tick's number is one to look at.
    pub(super) const HELD: Self = Self(32);

    /// These if `on`, otherwise none.
    #[inline]
    pub fn when(self, on: bool) -> Self {
        Self(u32::from(on) * self.0)
    }

    /// Both.
    #[inline]
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// These but for `other`.
    #[inline]
    pub(super) fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Any of `other` is among these.
    #[inline]
    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

/// What a tick saw.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observation {
    /// Torque that the control asks for, N m.
    pub wanted_nm: f32,
    /// Estimated velocity, rad/s.
    pub velocity_rad_s: f32,
    /// Estimated deflection, rad; looked at only for whether it is a number.
    pub z_rad: f32,
    /// Step since the last tick, counts; zero if it was rejected.
    pub step_counts: i32,
    /// What speaks against the tick.
    pub alarms: Alarms,
}

impl Observation {
    /// All of it are numbers.
    #[inline(always)]
    pub(super) fn is_finite(&self) -> bool {
        // Finite only if all three are.
        (self.wanted_nm + self.velocity_rad_s + self.z_rad).is_finite()
    }

    /// Zero, or NaN where one of them is no number or they are beyond all bounds.
    #[inline(always)]
    pub(super) fn nothing(&self) -> f32 {
        let sum = self.wanted_nm + self.z_rad;
        #[expect(clippy::eq_op, reason = "NaN where it is not finite")]
        let nothing = sum - sum;
        nothing
    }
}

/// What a usual tick stays within; no more than the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Usual {
    /// Largest speed, rad/s.
    pub(crate) speed_rad_s: f32,
    /// Largest torque that is put out as it is, N m.
    pub(crate) torque_nm: f32,
}
