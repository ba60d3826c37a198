//! What a stretch of the run cost.

/// What the handler of an exception cost, entry and exit excluded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Times it ran.
    pub runs: u64,
    /// Instructions of all runs.
    pub instructions: u64,
    /// Instructions of the longest run.
    pub most_instructions: u64,
    /// Estimated cycles of all runs.
    pub cycles: u64,
    /// Estimated cycles of the longest run.
    pub most_cycles: u64,
    /// Instructions of the last run.
    pub last_instructions: u64,
}

impl Cost {
    /// Adds a run.
    pub fn count(&mut self, instructions: u64, cycles: u64) {
        self.runs += 1;
        self.instructions += instructions;
        self.cycles += cycles;
        self.most_instructions = self.most_instructions.max(instructions);
        self.most_cycles = self.most_cycles.max(cycles);
        self.last_instructions = instructions;
    }

    /// Adds the runs of another.
    pub fn add(&mut self, other: Self) {
        self.runs += other.runs;
        self.instructions += other.instructions;
        self.cycles += other.cycles;
        self.most_instructions = self.most_instructions.max(other.most_instructions);
        self.most_cycles = self.most_cycles.max(other.most_cycles);
        self.last_instructions = other.last_instructions;
    }
}
