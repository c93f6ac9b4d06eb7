//! The syntax tree: what a file says, as its author wrote it.
//!
//! Every node carries the span of its text, so that later stages can point at it. Nothing is
//! resolved here: names are spellings, numbers keep their digits, units are words. Comments other
//! than documentation are not in the tree; `format` takes them from the source.

use serde::Serialize;

/// Which file of [`Sources`](super::Sources) a span points into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct FileId(pub u32);

/// A range of bytes of one file. Nodes that were built instead of read have [`Span::NONE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Span {
    pub file: FileId,
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

impl Span {
    /// The span of a node that was built instead of read.
    pub const NONE: Span = Span { file: FileId(0), start: 0, end: 0 };

    pub fn new(file: FileId, start: usize, end: usize) -> Self {
        Span { file, start, end }
    }

    /// The span from the start of `self` to the end of `last`, which must be in the same file.
    pub fn to(self, last: Span) -> Span {
        Span { end: last.end, ..self }
    }
}

/// A name or a word, as it was spelt.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Name {
    pub text: String,
    #[serde(skip)]
    pub span: Span,
}

impl Name {
    pub fn new(text: impl Into<String>, span: Span) -> Self {
        Name { text: text.into(), span }
    }

    /// A name that was built instead of read.
    pub fn built(text: impl Into<String>) -> Self {
        Name::new(text, Span::NONE)
    }
}

/// A text literal; escapes are resolved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Text {
    pub value: String,
    #[serde(skip)]
    pub span: Span,
}

impl Text {
    pub fn new(value: impl Into<String>, span: Span) -> Self {
        Text { value: value.into(), span }
    }
}

/// A number with its unit, for example `12.50 m/s`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Number {
    /// The digits exactly as written, without a sign: `12`, `0.50`, `1e-9`. Never converted here.
    pub digits: String,
    /// Any word, `%` included; the checker knows which words are units.
    pub unit: Option<Name>,
    #[serde(skip)]
    pub span: Span,
}

/// One line of documentation, without its marker.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Doc {
    pub text: String,
    #[serde(skip)]
    pub span: Span,
}

/// One file.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct File {
    /// Its `//!` lines.
    pub docs: Vec<Doc>,
    /// In the order of the text; `language` and `use` are items like the others.
    pub items: Vec<Item>,
    #[serde(skip)]
    pub span: Span,
}

/// One declaration with the `///` lines before it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Item {
    pub docs: Vec<Doc>,
    pub kind: ItemKind,
    /// From its first keyword to its last character; documentation excluded.
    #[serde(skip)]
    pub span: Span,
}

/// Declares the kinds of declarations. A row has the kind, its content, its keyword, and the field of its name if it has
/// one. It also has the method that gives the content (`None` for another kind).
macro_rules! kinds {
    ($($kind:ident($declared:ty) $keyword:literal $as_kind:ident $($name:ident)?;)+) => {
        /// A declaration by its kind.
        #[derive(Debug, Clone, PartialEq, Serialize)]
        pub enum ItemKind {
            $($kind($declared),)+
            /// `override` before a declaration: it replaces the declaration of that kind and name in a
            /// used file.
            Override(Box<ItemKind>),
        }

        impl ItemKind {
            /// The keyword that begins the declaration.
            pub fn keyword(&self) -> &'static str {
                match self {
                    $(ItemKind::$kind(_) => $keyword,)+
                    ItemKind::Override(_) => "override",
                }
            }

            /// The name of the declaration, if it has one.
            pub fn name(&self) -> Option<&Name> {
                match self {
                    $($(ItemKind::$kind(declared) => Some(&declared.$name),)?)+
                    ItemKind::Override(inner) => inner.name(),
                    _ => None,
                }
            }

            $(pub fn $as_kind(&self) -> Option<&$declared> {
                if let ItemKind::$kind(declared) = self { Some(declared) } else { None }
            })+
        }
    };
}

kinds! {
    Language(Number) "language" as_language;
    Use(Use) "use" as_use;
    Enum(Enum) "enum" as_enum name;
    Odds(Odds) "odds" as_odds name;
    State(State) "state" as_state name;
    Let(Let) "let" as_let name;
    Fn(Fn) "fn" as_fn name;
    Manoeuvre(Manoeuvre) "manoeuvre" as_manoeuvre name;
    Action(Action) "action" as_action name;
    Group(Group) "group" as_group name;
    Also(Also) "on" as_also;
    EachStep(Vec<Effect>) "each step" as_each_step;
    Rule(Rule) "rule" as_rule name;
    Require(Box<Require>) "require" as_require name;
    Body(Block) "body" as_body name;
    Trajectory(Block) "trajectory" as_trajectory name;
    Road(Block) "road" as_road name;
    Episode(Vec<Field>) "episode" as_episode;
    Reward(Vec<Case>) "reward" as_reward;
    Verdict(Verdict) "verdict" as_verdict name;
    Expect(Expect) "expect" as_expect;
    Scenario(Scenario) "scenario" as_scenario name;
    Policy(Policy) "policy" as_policy name;
}

impl ItemKind {
    /// The declaration itself, without `override`.
    pub fn plain(&self) -> &ItemKind {
        match self {
            ItemKind::Override(inner) => inner.plain(),
            kind => kind,
        }
    }
}

/// `use "roads.ava" digest "sha256:…"`.
///
/// The digest covers what the used file and all that it uses declare, and their maps: `check::meaning` says what
/// that is. After the digest and a blank may stand a mark for each declaration, which tells what changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Use {
    pub path: Text,
    pub digest: Option<Text>,
    /// Actions, groups and rules of the used file that are left out.
    pub without: Vec<Name>,
}

/// `enum Level = None < Light < High` or `enum Side = Left | Right`. Never empty.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Enum {
    pub name: Name,
    /// Whether `<` stood between the variants. A single variant is not ordered.
    pub ordered: bool,
    pub variants: Vec<Name>,
}

/// `odds Vehicle { BoxTruck | SchoolBus => 2 }`: how often a variant is drawn, relative to the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Odds {
    /// Name of the enum.
    pub name: Name,
    pub arms: Vec<Arm>,
}

/// `state sky: Sky -> Level = None`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct State {
    pub name: Name,
    pub ty: Type,
    pub initial: Initial,
}

/// The value of a state when an episode begins.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Initial {
    /// `any`: the value is drawn.
    Any,
    Value(Expr),
    /// `{ Fog: Moderate, _: None }`: a value for each key of a map.
    Keys(Vec<InitialKey>),
}

/// `Fog: Moderate`, `Rain: any`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InitialKey {
    /// `None` for `_`, which stands for every key that is left.
    pub key: Option<Name>,
    /// `None` for `any`: the value is drawn.
    pub value: Option<Expr>,
    #[serde(skip)]
    pub span: Span,
}

/// `Time`, `Length`, or the map `Sky -> Level`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Type {
    pub kind: TypeKind,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum TypeKind {
    Named(Name),
    Map { key: Name, value: Name },
}

/// `let weight_size = 1.0`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Let {
    pub name: Name,
    pub value: Expr,
}

/// `fn lead(v: Speed) -> Length = v * 0.5 s`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fn {
    pub name: Name,
    pub params: Vec<FnParam>,
    pub result: Type,
    pub body: Expr,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FnParam {
    pub name: Name,
    pub ty: Type,
}

/// `manoeuvre brake(to: Speed, rate: Accel) repeat 2 { after 3 s { speed: to, rate: rate } }`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Manoeuvre {
    pub name: Name,
    pub params: Vec<FnParam>,
    pub repeat: Option<Expr>,
    pub phases: Vec<Phase>,
}

/// `once npc.gap <= 20 m for 0.5 s within 10 s after 1 s { speed: 0 m/s }`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Phase {
    pub once: Option<Expr>,
    /// How long `once` must have held.
    pub held: Option<Expr>,
    pub within: Option<Expr>,
    pub after: Option<Expr>,
    /// Without it the phase always comes.
    pub only_if: Option<Expr>,
    pub fields: Vec<Field>,
    #[serde(skip)]
    pub span: Span,
}

/// `action name(each a: A, any b: B in lo .. hi) { effects }`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Action {
    pub name: Name,
    pub params: Vec<ActionParam>,
    pub effects: Vec<Effect>,
}

/// One parameter of an action.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActionParam {
    pub mode: ParamMode,
    pub name: Name,
    pub ty: Type,
    /// The expression after `in`: a range or a list. Both modes may have one.
    pub within: Option<Expr>,
    /// The expression after `where`. Both modes may have one.
    pub condition: Option<Expr>,
    #[serde(skip)]
    pub span: Span,
}

/// How a parameter gets its value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum ParamMode {
    /// `each`: the parameter is an axis of the action table.
    Each,
    /// `any`: the value is drawn when the action runs.
    Any,
}

/// One change of the world.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effect {
    pub kind: EffectKind,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum EffectKind {
    /// `set sky = None`, `set sky[what] = how`.
    Set {
        state: Name,
        key: Option<Box<Expr>>,
        value: Box<Expr>,
    },
    Spawn(Box<Spawn>),
    /// `order truck { speed: 0 m/s }`.
    Order {
        who: Name,
        fields: Vec<Field>,
    },
}

/// `spawn vehicle ahead distance { speed: speed }`.
/// With a `cover`: `spawn Pedestrian ahead distance from behind SUV { … }`.
/// With a name for its bearer: `spawn BoxTruck as truck ahead distance { … }`; with several for a row:
/// `spawn BoxTruck as [last, first] ahead distance apart 15 m { … }`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spawn {
    pub body: Expr,
    pub bearers: Vec<Name>,
    pub place: Place,
    pub distance: Expr,
    /// The road user from which the distance is measured; the ego vehicle without it.
    pub of: Option<Name>,
    pub apart: Option<Expr>,
    pub cover: Option<Expr>,
    pub fields: Vec<Field>,
}

impl Effect {
    /// The spawn of the effect, if it is one.
    pub fn spawn(&self) -> Option<&Spawn> {
        match &self.kind {
            EffectKind::Spawn(spawn) => Some(spawn),
            EffectKind::Set { .. } | EffectKind::Order { .. } => None,
        }
    }
}

/// From where the distance of a spawn counts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Place {
    /// Ahead of the ego vehicle, along its route.
    Ahead,
    Behind,
    /// From the beginning of a trajectory.
    On(Box<Expr>),
    /// On a trajectory that lies beside the ego vehicle's route, ahead of it or behind it.
    Along {
        trajectory: Box<Expr>,
        behind: bool,
    },
}

impl Place {
    pub fn is_behind(&self) -> bool {
        matches!(self, Place::Behind | Place::Along { behind: true, .. })
    }

    /// The trajectory, if there is one.
    pub fn trajectory(&self) -> Option<&Expr> {
        match self {
            Place::On(trajectory) | Place::Along { trajectory, .. } => Some(trajectory),
            Place::Ahead | Place::Behind => None,
        }
    }
}

/// `group vehicles = drive_ahead, overtake`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    pub name: Name,
    pub members: Vec<Name>,
}

/// `on vehicles also { set spawned = spawned + 1 }`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Also {
    /// Actions and groups.
    pub on: Vec<Name>,
    /// Each is a `set`.
    pub effects: Vec<Effect>,
}

/// A named constraint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rule {
    /// Whether the rule is off unless `--with` names it.
    pub optional: bool,
    pub name: Name,
    pub body: RuleBody,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum RuleBody {
    /// `on a, b: condition`. Without `on` it holds for every action: `on` is empty. With `during change` it is about
    /// what road users do later.
    Holds { on: Vec<Name>, during: Option<Name>, condition: Expr },
    /// `on state { A -> A | B }`, `on state[key] { A -> A | B }`.
    Moves { state: Name, key: Option<Name>, moves: Vec<Move> },
}

/// `Noon -> Noon | Night`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Move {
    pub from: Name,
    pub to: Vec<Name>,
    #[serde(skip)]
    pub span: Span,
}

/// `require distance when ego.lead_since >= 3 s: ego.lead_gap >= 0.8 s * ego.speed within 2 s`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Require {
    /// Whether it is off unless `--with` names it.
    pub optional: bool,
    pub name: Name,
    /// The bodies of the road users that it is about, each by itself; empty if it is about the ego vehicle alone.
    pub on: Vec<Name>,
    pub when: Option<Expr>,
    /// The end of what began by `when`.
    pub until: Option<Expr>,
    /// The condition that must begin to hold before the requirement is asked.
    pub after: Option<Expr>,
    pub condition: Expr,
    /// A condition that excuses a breach.
    pub unless: Option<Expr>,
    pub within: Option<Expr>,
}

impl Require {
    /// Its expressions, in the order of the text.
    pub fn parts(&self) -> impl Iterator<Item = &Expr> {
        self.conditions().chain(&self.within)
    }

    /// Its conditions, in the order of the text.
    pub fn conditions(&self) -> impl Iterator<Item = &Expr> {
        self.when.iter().chain(&self.until).chain(&self.after).chain([&self.condition]).chain(&self.unless)
    }
}

/// `name { field: value … }`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Block {
    pub name: Name,
    pub fields: Vec<Field>,
}

/// `field: value`. Any word may name a field.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Field {
    pub name: Name,
    pub value: Expr,
    #[serde(skip)]
    pub span: Span,
}

/// A line of `reward`: `condition => value`; `_` has no condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    pub condition: Option<Expr>,
    pub value: Expr,
    #[serde(skip)]
    pub span: Span,
}

/// `verdict counted: collision and not repeated`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    pub name: Name,
    pub condition: Expr,
}

/// A claim to be checked: `expect count(actions) == 45`, `expect collision with npc#2 at 14.22 s`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Expect {
    pub claim: Expr,
    /// `with`, `at` and `by`, in the order of the text.
    pub clauses: Vec<Clause>,
    #[serde(skip)]
    pub span: Span,
}

/// `with npc#2`, `at 14.22 s`, `by [cc, fsm]`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Clause {
    pub kind: ClauseKind,
    pub value: Expr,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum ClauseKind {
    With,
    At,
    By,
}

/// A scenario: one concrete timeline over a space.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scenario {
    pub name: Name,
    /// Where the scenario came from; may be empty.
    pub origin: Vec<Field>,
    pub road: Name,
    /// The states at the start; may be empty.
    pub start: Vec<Field>,
    pub steps: Vec<Step>,
    pub expects: Vec<Expect>,
}

/// `2: drive_ahead(lane: Left) with { speed: 11.25 m/s }`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    pub number: Number,
    pub action: Call,
    /// The drawn parameters.
    pub drawn: Vec<Field>,
    /// The condition that the action waits for, how long it must have held, and how long the action waits from then on.
    pub once: Option<Expr>,
    pub held: Option<Expr>,
    pub after: Option<Expr>,
    #[serde(skip)]
    pub span: Span,
}

/// `name(arguments)`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Call {
    pub name: Name,
    pub args: Vec<Arg>,
    #[serde(skip)]
    pub span: Span,
}

/// `value` or `name: value`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Arg {
    pub name: Option<Name>,
    pub value: Expr,
}

/// A policy: what an agent learned.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Policy {
    pub name: Name,
    pub origin: Vec<Field>,
    /// The exact face, the network; empty if the file has none.
    pub net: Vec<Field>,
    /// The results that the policy claims, with each face.
    pub claims: Vec<Field>,
    /// The readable face: the first line that applies acts. Empty if the file has none.
    pub rules: Vec<PolicyLine>,
}

/// `when condition => action(arguments) | …`; `_` has no condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PolicyLine {
    pub condition: Option<Expr>,
    /// At least one call; the first that is legal acts.
    pub actions: Vec<Call>,
    #[serde(skip)]
    pub span: Span,
}

/// An expression. Parentheses are not kept: the printer puts them where they are needed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Expr {
    pub kind: ExprKind,
    #[serde(skip)]
    pub span: Span,
}

impl Expr {
    /// An expression that was built instead of read.
    pub fn built(kind: ExprKind) -> Self {
        Expr { kind, span: Span::NONE }
    }

    /// The expressions directly inside this one, in the order of the text.
    pub fn parts(&self) -> Vec<&Expr> {
        match &self.kind {
            ExprKind::Unary { operand, .. } => vec![operand],
            ExprKind::Binary { left, right, .. } => vec![left, right],
            ExprKind::Range { low, high } => vec![low, high],
            ExprKind::Index { base, index } => vec![base, index],
            ExprKind::Field { base, .. } => vec![base],
            ExprKind::Call(call) => call.args.iter().map(|argument| &argument.value).collect(),
            ExprKind::List(items) => items.iter().collect(),
            ExprKind::Record(fields) => fields.iter().map(|field| &field.value).collect(),
            ExprKind::Match { subject, arms } => {
                core::iter::once(&**subject).chain(arms.iter().map(|arm| &arm.value)).collect()
            }
            ExprKind::Number(_)
            | ExprKind::Text(_)
            | ExprKind::Bool(_)
            | ExprKind::Name(_)
            | ExprKind::LanePoint { .. }
            | ExprKind::Numbered { .. } => Vec::new(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum ExprKind {
    Number(Number),
    Text(String),
    Bool(bool),
    /// A parameter, a constant, a variant or a state; the checker decides which.
    Name(String),
    Unary {
        op: UnaryOp,
        operand: Box<Expr>,
    },
    Binary {
        op: BinaryOp,
        #[serde(skip)]
        op_span: Span,
        left: Box<Expr>,
        right: Box<Expr>,
    },
    /// `road.limit`.
    Field {
        base: Box<Expr>,
        field: Name,
    },
    /// `sky[Rain]`.
    Index {
        base: Box<Expr>,
        index: Box<Expr>,
    },
    /// `gap(mode, size, v)`.
    Call(Call),
    /// `[a, b]`.
    List(Vec<Expr>),
    /// `{ Rain: High, Fog: None }`.
    Record(Vec<Field>),
    /// `lo .. hi`, both ends included.
    Range {
        low: Box<Expr>,
        high: Box<Expr>,
    },
    Match {
        subject: Box<Expr>,
        arms: Vec<Arm>,
    },
    /// `lane 7/-1 at 80 m`: a point of an OpenDRIVE map.
    LanePoint {
        /// The road's id: a number or, quoted in the source, any text.
        road: Text,
        /// Lane id with its sign.
        lane: Name,
        station: Number,
    },
    /// `npc#2`: the second road user to appear.
    Numbered {
        name: Name,
        number: String,
    },
}

/// `A | B => value`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Arm {
    /// Empty for `_`, which matches all that is left. Else variants, truth values or whole numbers.
    pub patterns: Vec<Name>,
    pub value: Expr,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum UnaryOp {
    Not,
    Negate,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum BinaryOp {
    Implies,
    Or,
    And,
    /// Membership in a list, a range or `road.lanes`.
    In,
    #[serde(untagged)]
    Compare(Comparison),
    #[serde(untagged)]
    Arithmetic(Arithmetic),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Comparison {
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Arithmetic {
    Add,
    Subtract,
    Multiply,
    Divide,
}

impl BinaryOp {
    pub const ALL: [BinaryOp; 14] = [
        BinaryOp::Implies,
        BinaryOp::Or,
        BinaryOp::And,
        BinaryOp::In,
        BinaryOp::Compare(Comparison::Equal),
        BinaryOp::Compare(Comparison::NotEqual),
        BinaryOp::Compare(Comparison::Less),
        BinaryOp::Compare(Comparison::LessEqual),
        BinaryOp::Compare(Comparison::Greater),
        BinaryOp::Compare(Comparison::GreaterEqual),
        BinaryOp::Arithmetic(Arithmetic::Add),
        BinaryOp::Arithmetic(Arithmetic::Subtract),
        BinaryOp::Arithmetic(Arithmetic::Multiply),
        BinaryOp::Arithmetic(Arithmetic::Divide),
    ];

    pub fn symbol(self) -> &'static str {
        match self {
            BinaryOp::Implies => "implies",
            BinaryOp::Or => "or",
            BinaryOp::And => "and",
            BinaryOp::In => "in",
            BinaryOp::Compare(comparison) => comparison.symbol(),
            BinaryOp::Arithmetic(Arithmetic::Add) => "+",
            BinaryOp::Arithmetic(Arithmetic::Subtract) => "-",
            BinaryOp::Arithmetic(Arithmetic::Multiply) => "*",
            BinaryOp::Arithmetic(Arithmetic::Divide) => "/",
        }
    }
}

impl Comparison {
    /// The same comparison read from right to left.
    pub fn mirrored(self) -> Comparison {
        match self {
            Comparison::Less => Comparison::Greater,
            Comparison::LessEqual => Comparison::GreaterEqual,
            Comparison::Greater => Comparison::Less,
            Comparison::GreaterEqual => Comparison::LessEqual,
            Comparison::Equal | Comparison::NotEqual => self,
        }
    }

    /// The comparison that holds where this one fails, if both sides have a value.
    pub fn negated(self) -> Comparison {
        match self {
            Comparison::Equal => Comparison::NotEqual,
            Comparison::NotEqual => Comparison::Equal,
            Comparison::Less => Comparison::GreaterEqual,
            Comparison::LessEqual => Comparison::Greater,
            Comparison::Greater => Comparison::LessEqual,
            Comparison::GreaterEqual => Comparison::Less,
        }
    }

    /// Whether it asks for an order, and not only whether both sides are the same.
    pub fn orders(self) -> bool {
        !matches!(self, Comparison::Equal | Comparison::NotEqual)
    }

    /// Whether the comparison holds, without a tolerance.
    pub fn holds<T: PartialOrd>(self, left: T, right: T) -> bool {
        match self {
            Comparison::Equal => left == right,
            Comparison::NotEqual => left != right,
            Comparison::Less => left < right,
            Comparison::LessEqual => left <= right,
            Comparison::Greater => left > right,
            Comparison::GreaterEqual => left >= right,
        }
    }

    pub fn symbol(self) -> &'static str {
        match self {
            Comparison::Equal => "==",
            Comparison::NotEqual => "!=",
            Comparison::Less => "<",
            Comparison::LessEqual => "<=",
            Comparison::Greater => ">",
            Comparison::GreaterEqual => ">=",
        }
    }
}
