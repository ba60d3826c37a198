//! Numbers of the wire form and their words: where the supervisor stands, what limits the output, and every fault.

macro_rules! codes {
    ($(#[$doc:meta])* $name:ident { $($(#[$entry:meta])* $variant:ident = $number:literal $text:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $name {
            $($(#[$entry])* $variant = $number,)+
        }

        impl $name {
            /// All of them, by number.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The one with a number.
            pub fn of(number: u8) -> Option<Self> {
                match number {
                    $($number => Some(Self::$variant),)+
                    _ => None,
                }
            }

            /// In words.
            pub fn text(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)+
                }
            }
        }
    };
}
pub(crate) use codes;

codes! {
    /// Where the supervisor stands.
    State {
        /// Before the inputs have settled.
        #[default]
        Boot = 0 "boot",
        /// Ready to be armed.
        Idle = 1 "idle",
        /// Torque may flow.
        Armed = 2 "armed",
        /// A fault is latched.
        Fault = 3 "fault",
    }
}

codes! {
    /// What keeps the output from being what was asked for.
    Limit {
        /// Nothing.
        #[default]
        None = 0 "nothing",
        /// The drive is not armed.
        Disarmed = 1 "not armed",
        /// The largest torque.
        Torque = 2 "torque limit",
        /// The largest change of torque in a tick.
        Slew = 3 "slew limit",
        /// A stop, or a command time-out, takes the torque down.
        Ramp = 4 "ramp to zero",
    }
}

codes! {
    /// Why the drive was taken away. The numbers are part of the wire form.
    Fault {
        /// No fault.
        #[default]
        None = 0 "no fault",
        /// Reported by the encoder's timer.
        EncoderIllegal = 1 "encoder: A and B changed at once, a count may be lost",
        /// The count at the index is not a whole number of turns from the first one.
        IndexMismatch = 2 "encoder: index at the wrong count, counts were lost or made",
        /// Velocity above the limit, or a step too large to be motion.
        Overspeed = 3 "overspeed",
        /// Torque or slew limit for too long.
        LimitTooLong = 4 "torque or slew limit reached for too long",
        /// A tick came late, was lost, or was still running when the next one was due.
        DeadlineMissed = 5 "control tick missed its deadline",
        /// A torque, velocity or deflection that is not a number.
        NotFinite = 6 "a value is not finite",
        /// The drive's own signal.
        DriveFault = 7 "drive reports a fault",
        /// No command for too long while armed.
        CommandTimeout = 8 "no command from the host for too long",
        /// The last reset was the watchdog's.
        WatchdogReset = 9 "the watchdog reset the controller",
        /// Torque well above break-away, and no count.
        StuckEncoder = 10 "torque above break-away but no encoder count",
    }
}
