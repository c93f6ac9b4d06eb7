//! The codes of mistakes in meaning. Never reused, never renumbered.

// Names and files.

/// A name that is declared nowhere.
pub const UNKNOWN: &str = "AV0101";
/// A name that is declared twice.
pub const DUPLICATE: &str = "AV0102";
/// A variant of several enums, where nothing says which enum is meant.
pub const AMBIGUOUS: &str = "AV0103";
/// A name that exists, but cannot be used in this place.
pub const NOT_HERE: &str = "AV0104";
/// Functions that call each other in a circle.
pub const RECURSION: &str = "AV0105";
/// A file that cannot be read, or a map that cannot be understood.
pub const UNREADABLE: &str = "AV0106";
/// A function that needs too many operations.
pub const TOO_LARGE: &str = "AV0107";
/// A place that a map does not have, or two places with no way between them.
pub const NO_ROUTE: &str = "AV0108";
/// Files that use each other in a circle.
pub const IMPORT_CYCLE: &str = "AV0109";
/// An imported file whose digest is not the one written in `use`.
pub const DIGEST: &str = "AV0110";
/// A declaration that nothing names.
pub const UNUSED: &str = "AV0111";
/// An `override` of nothing.
pub const OVERRIDE: &str = "AV0112";
/// A space that is too large to be checked.
pub const TOO_MUCH: &str = "AV0113";
/// Features of the map on a route that drivers do not know: slopes, solid objects in a lane.
pub const NOT_DRIVEN: &str = "AV0114";

// Types and units.

/// Two dimensions where one is needed.
pub const UNIT_MISMATCH: &str = "AV0201";
/// Two types where one is needed.
pub const TYPE_MISMATCH: &str = "AV0202";
/// An unknown unit.
pub const UNKNOWN_UNIT: &str = "AV0203";
/// `<` between things that have no order.
pub const UNORDERED: &str = "AV0204";
/// Cases that are not covered.
pub const NOT_EXHAUSTIVE: &str = "AV0205";
/// A case that is never reached.
pub const NEVER_REACHED: &str = "AV0206";
/// A number that cannot be computed exactly.
pub const NUMBER: &str = "AV0207";
/// An enum with too many variants.
pub const TOO_MANY_VARIANTS: &str = "AV0208";
/// A setting out of its range.
pub const SETTING: &str = "AV0209";
/// An unknown reason to stop in `stop` of `episode`.
pub const STOP: &str = "AV0210";
/// Arguments that are too many or too few.
pub const ARGUMENTS: &str = "AV0211";

// Actions.

/// A parameter with infinitely many values where a list is needed.
pub const INFINITE: &str = "AV0301";
/// A table with too many rows.
pub const TOO_MANY_ROWS: &str = "AV0302";
/// Two rows with equal draws, effects and rules.
pub const TWINS: &str = "AV0303";
/// A range, a list or a `where` that leaves nothing.
pub const EMPTY: &str = "AV0304";
/// An action without an effect.
pub const NO_EFFECT: &str = "AV0305";
/// A field that is missing.
pub const MISSING_FIELD: &str = "AV0306";
/// An effect or a rule on a state that is not declared.
pub const UNKNOWN_STATE: &str = "AV0307";
/// A word that the engine does not know.
pub const NOT_A_WORD: &str = "AV0308";
/// A road user whose body cannot do what the verb says.
pub const IMPOSSIBLE_SPAWN: &str = "AV0309";
/// A spawn whose speed or distance may lie out of bounds.
pub const OUT_OF_BOUNDS: &str = "AV0310";

// Rules.

/// A row that can run on no road.
pub const DEAD: &str = "AV0401";
/// Rows that cannot run on some road.
pub const MASKED: &str = "AV0402";
/// Rows that are neither proved dead nor found to run.
pub const UNDECIDED: &str = "AV0403";
/// A range of which rules leave less than half, or listed values that they never leave.
pub const CUT: &str = "AV0404";
/// A rule that names a parameter which its action lacks.
pub const LACKING_PARAMETER: &str = "AV0405";
/// A rule about spawns on an action that has none.
pub const NO_SPAWN: &str = "AV0406";
/// A rule that would never be enforced.
pub const BINDS_NOTHING: &str = "AV0407";
/// A rule that can refuse nothing.
pub const NEVER_ACTS: &str = "AV0408";
/// A spawn that no careful driver could avoid.
pub const UNFAIR: &str = "AV0409";
/// A rule that follows from others.
pub const IMPLIED: &str = "AV0410";
/// A rule under which no episode can begin.
pub const NO_START: &str = "AV0411";
/// A rule about the moment of the draw that names what happens later.
pub const LATER: &str = "AV0412";
/// A rule under which no lane change begins.
pub const NO_CHANGE: &str = "AV0413";
/// A rule on states and time that a step without an action breaks.
pub const BROKEN_BY_TIME: &str = "AV0414";
/// A requirement that nothing can breach.
pub const ALWAYS_KEPT: &str = "AV0415";
/// A requirement that divides by what may be 0.
pub const OPEN_DIVISOR: &str = "AV0416";
/// A value that a transition rule does not lead out of.
pub const DEADLOCK: &str = "AV0501";
/// A value that a transition rule does not lead to.
pub const UNREACHABLE: &str = "AV0502";
/// A value from which no move leads to another value.
pub const STUCK: &str = "AV0503";
/// A row that a transition rule never allows.
pub const NEVER_ENABLED: &str = "AV0504";

// Scenarios.

/// A call that names no row of the table.
pub const NO_SUCH_ROW: &str = "AV0601";
/// Steps that are out of order.
pub const STEP_ORDER: &str = "AV0602";
/// A drawn value that is missing.
pub const NOT_DRAWN: &str = "AV0603";
/// A drawn value out of its range.
pub const OUT_OF_RANGE: &str = "AV0604";
/// A step that breaks a rule.
pub const BROKEN_RULE: &str = "AV0605";
/// A start that leaves a state open.
pub const OPEN_START: &str = "AV0606";
/// A claim of an unknown form.
pub const UNKNOWN_CLAIM: &str = "AV0607";
/// A moment that cannot come within its step.
pub const TRIGGER: &str = "AV0609";
/// A file with no scenario, or with two.
pub const ONE_SCENARIO: &str = "AV0608";

// Policies.

/// A network that fits neither its table nor its own layers.
pub const POLICY_SHAPE: &str = "AV0701";
/// A policy file that was changed after it was written.
pub const POLICY_DIGEST: &str = "AV0702";
/// A policy that cannot be read.
pub const POLICY_FORM: &str = "AV0703";
/// A file with two policies.
pub const ONE_POLICY: &str = "AV0704";
/// A variable that no policy sees.
pub const POLICY_VARIABLE: &str = "AV0705";
/// A row that is never legal where its line applies.
pub const POLICY_ROW: &str = "AV0706";
/// A line that applies to no state.
pub const POLICY_NOWHERE: &str = "AV0707";
/// A line, or a row of it, that never acts.
pub const POLICY_SHADOWED: &str = "AV0708";

// Static claims.

/// A claim that is false.
pub const FALSE_CLAIM: &str = "AV0801";
/// A claim that cannot be made of a space.
pub const NOT_STATIC: &str = "AV0802";

// Style.

/// A name that looks like another kind of thing.
pub const NAME_STYLE: &str = "AV0901";
/// `x == true`.
pub const COMPARED_WITH_TRUTH: &str = "AV0902";
