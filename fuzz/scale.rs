//! Texts that are large in one construct: each maker takes a size and gives a text in which that construct occurs so many
//! times, or is so deep or so long. They find work that grows faster than the text.
//!
//! Shared by the fuzz target `scale`, and by `tests/it/hostile.rs`, which runs the program on them and measures. A text
//! may use `roads.ava`; maps are made in `scaling_maps.rs`. Add a maker for each new rule of `grammar/ava.pest`.

/// A construct: its name, and the text that has it so many times.
pub type Construct = (&'static str, fn(usize) -> String);

const HEAD: &str = "language 1\n";
const ROADS: &str = "language 1\nuse \"roads.ava\"\n";
const BOOL: &str = "state b: Bool = true\n";
const COUNT: &str = "state c: Int = 0\n";
const ACTION: &str = "action a() { set b = false }\n";

/// The first numbers, each as the maker writes it.
fn each(count: usize, write: impl Fn(usize) -> String) -> String {
    (0..count).map(write).collect()
}

fn listed(count: usize, between: &str, write: impl Fn(usize) -> String) -> String {
    (0..count).map(write).collect::<Vec<_>>().join(between)
}

/// An enum `E` with as many variants as there may be.
fn largest_enum() -> String {
    format!("enum E = {}\n", listed(128, " | ", |i| format!("V{i}")))
}

/// Makers for the language, by construct.
pub const GRAMMAR: &[Construct] = &[
    ("declarations", |n| HEAD.to_owned() + &each(n, |i| format!("let a{i} = {i}\n"))),
    ("comments", |n| HEAD.to_owned() + &"/// a\n// b\n".repeat(n)),
    ("mistakes", |n| HEAD.to_owned() + &"let ( = } \n".repeat(n)),
    ("signs without a meaning", |n| HEAD.to_owned() + &"§ x y\n".repeat(n)),
    ("one long line", |n| HEAD.to_owned() + &"let a = 1 ".repeat(n) + "\n"),
    ("open texts", |n| HEAD.to_owned() + &"let a = \"".repeat(n) + "\n"),
    ("uses of no file", |n| HEAD.to_owned() + &each(n, |i| format!("use \"{i}.ava\"\n"))),
    ("uses of one file", |n| HEAD.to_owned() + &"use \"roads.ava\"\n".repeat(n)),
    ("names left out", |n| {
        format!("{HEAD}use \"roads.ava\" without {}\n", listed(n, ", ", |i| format!("x{i}")))
    }),
    ("a long name", |n| format!("{HEAD}let {0} = 1\nlet b = {0}c\n", "a".repeat(n))),
    ("long unknown names", |n| HEAD.to_owned() + &each(n, |i| format!("let x{i} = {}\n", "a".repeat(500)))),
    ("a long number", |n| format!("{HEAD}let a = {}\n", "9".repeat(n))),
    ("a sum", |n| format!("{HEAD}let a = 1{}\n", "+1".repeat(n))),
    ("signs before", |n| format!("{HEAD}let a = {}1\n", "-".repeat(n))),
    ("brackets", |n| format!("{HEAD}let a = {}1{}\n", "(".repeat(n), ")".repeat(n))),
    ("a list", |n| format!("{HEAD}let a = [{}]\n", listed(n, ", ", |i| i.to_string()))),
    ("unknown names", |n| HEAD.to_owned() + &each(n, |i| format!("let a{i} = b{i}\n"))),
    ("one name twice", |n| HEAD.to_owned() + &"let a = 1\n".repeat(n)),
    ("constants in a chain", |n| {
        format!("{HEAD}let a0 = 1\n{}", each(n, |i| format!("let a{} = a{i}\n", i + 1)))
    }),
    ("constants in a chain, the last first", |n| {
        format!("{HEAD}{}let a{n} = 1\n", each(n, |i| format!("let a{i} = a{}\n", i + 1)))
    }),
    ("constants in a circle", |n| HEAD.to_owned() + &each(n, |i| format!("let a{i} = a{}\n", (i + 1) % n))),
    ("enums", |n| HEAD.to_owned() + &each(n, |i| format!("enum E{i} = A | B\n"))),
    ("an ambiguous variant", |n| {
        HEAD.to_owned() + &each(n, |i| format!("enum E{i} = A | B\nlet x{i} = A\n"))
    }),
    ("variants", |n| format!("{HEAD}enum E = {}\n", listed(n, " | ", |i| format!("V{i}")))),
    ("odds of variants", |n| {
        let lines = each(n, |i| format!("V{} => 1\n", i % 128));
        format!("{HEAD}{}odds E {{ {lines} }}\n", largest_enum())
    }),
    ("odds of actions", |n| {
        let actions = each(n, |i| format!("action a{i}() {{ set b = true }}\n"));
        format!("{HEAD}{BOOL}{actions}odds actions {{ {} }}\n", each(n, |i| format!("a{i} => 2\n")))
    }),
    ("cases of a number", |n| {
        format!("{HEAD}fn f(x: Int) -> Int = match x {{ {}_ => 0 }}\n", each(n, |i| format!("{i} => 1\n")))
    }),
    ("cases of a number in a rule", |n| {
        let cases = each(n, |i| format!("{i} => 1\n"));
        format!("{ROADS}{COUNT}action a() {{ set c = 1 }}\nrule r: 0 <= match c {{ {cases}_ => 0 }}\n")
    }),
    ("matches in the subject", |n| {
        let arms = " { true => false, false => true }".repeat(n);
        format!("{HEAD}fn f(x: Bool) -> Bool = {}x{arms}\n", "match ".repeat(n))
    }),
    ("matches in arms for all variants", |n| {
        let depth = n.min(60);
        let open = "match e { V0 => 1, _ => ".repeat(depth);
        let used = "state s: E = any\naction a() { set s = V1 }\nrule r: f(s) >= 1\n";
        format!("{ROADS}{}fn f(e: E) -> Int = {open}2{}\n{used}", largest_enum(), " }".repeat(depth))
    }),
    ("numbers matched in the subject", |n| {
        let subject = (0..n.min(60))
            .fold("x".to_owned(), |inner, _| format!("match {inner} {{ 0 => 1, 1 => 2, 2 => 3, _ => 0 }}"));
        format!("{HEAD}fn f(x: Int) -> Int = {subject}\n")
    }),
    ("functions that call one another twice", |n| {
        let calls = each(n, |i| format!("fn f{}(x: Int) -> Int = f{i}(x) + f{i}(x)\n", i + 1));
        format!("{HEAD}fn f0(x: Int) -> Int = x + x\n{calls}")
    }),
    ("a function of itself", |n| {
        let depth = n.min(60);
        let called = format!("{}d{}", "f(".repeat(depth), ")".repeat(depth));
        let action = "action a(any d: Length in 1 m .. 2 m) { set b = d > 1 m }\n\
                          action z(any d: Length in 1 m .. 2 m) { set b = d > 1 m }\n";
        format!(
            "{ROADS}{BOOL}fn f(x: Length) -> Length = x + x - x\n{action}rule r on a, z: {called} <= 3 m\n"
        )
    }),
    ("parameters of a function", |n| {
        format!("{HEAD}fn f({}) -> Int = p0\n", listed(n, ", ", |i| format!("p{i}: Int")))
    }),
    ("bodies", |n| {
        let bodies = each(n, |i| format!("body B{i} {{ like: Motorcycle, length: 1.8 m }}\n"));
        format!("{ROADS}{BOOL}{ACTION}{bodies}")
    }),
    ("states", |n| {
        format!(
            "{ROADS}{}action a() {{ set s0 = false }}\n",
            each(n, |i| format!("state s{i}: Bool = true\n"))
        )
    }),
    ("states with rules", |n| {
        let one = |i: usize| {
            let next = (i + 1) % n;
            format!(
                "state s{i}: Bool = true\naction a{i}() {{ set s{i} = false }}\nrule r{i}: s{i} or s{next}\n"
            )
        };
        ROADS.to_owned() + &each(n, one)
    }),
    ("drawn states with rules", |n| {
        let one = |i: usize| {
            let next = (i + 1) % n;
            format!(
                "state s{i}: Bool = any\naction a{i}() {{ set s{i} = false }}\nrule r{i}: s{i} or s{next}\n"
            )
        };
        ROADS.to_owned() + &each(n, one)
    }),
    ("states with rules about time", |n| {
        let one = |i: usize| {
            format!(
                "state s{i}: Bool = true\naction a{i}() {{ set s{i} = false }}\nrule r{i}: s{i} or step >= 0\n"
            )
        };
        ROADS.to_owned() + &each(n, one)
    }),
    ("states with transitions", |n| {
        let one = |i: usize| {
            let moves = "{ A -> A | B, B -> B | C, C -> C | A }";
            format!(
                "state s{i}: T = any\naction a{i}(each e: T) {{ set s{i} = e }}\nrule r{i} on s{i} {moves}\n"
            )
        };
        format!("{ROADS}enum T = A | B | C\n{}", each(n, one))
    }),
    ("maps of a drawn start", |n| {
        let n = n.min(128);
        let variants = listed(n, " | ", |i| format!("V{i}"));
        let states = "state s: E -> E = any\nstate t: E -> E = any\n";
        let action = "action a(each e: E) { set s[e] = e }\n";
        format!("{ROADS}enum E = {variants}\n{states}{action}rule r: s[V0] == t[V0]\n")
    }),
    ("maps beside many rows", |n| {
        let states = each(n, |i| format!("state s{i}: E -> E = V0\n"));
        format!("{ROADS}{}{states}action a(each e: E, each f: E) {{ set s0[e] = f }}\n", largest_enum())
    }),
    ("keys of a beginning", |n| {
        let keys = each(n, |i| format!("V{}: true\n", i % 128));
        format!("{HEAD}{}state s: E -> Bool = {{ {keys} }}\n", largest_enum())
    }),
    ("actions", |n| format!("{ROADS}{BOOL}{}", each(n, |i| format!("action a{i}() {{ set b = false }}\n")))),
    ("actions that spawn", |n| {
        let spawn = "spawn Sedan ahead d { lane: Current, speed: 5 m/s, does: DriveAhead }";
        ROADS.to_owned() + &each(n, |i| format!("action a{i}(any d: Length in 30 m .. 50 m) {{ {spawn} }}\n"))
    }),
    ("effects", |n| {
        format!("{ROADS}{COUNT}action a() {{ {} }}\nrule r: c >= 0\n", "set c = c + c\n".repeat(n))
    }),
    ("effects of one key", |n| {
        let sets = each(n, |i| format!("set s[V{}] = s[e]\n", i % 128));
        format!("{ROADS}{}state s: E -> Bool = true\naction a(each e: E) {{ {sets} }}\n", largest_enum())
    }),
    ("spawns of one action", |n| {
        let spawn = "spawn Sedan ahead 30 m { lane: Current, speed: v, does: DriveAhead }\n".repeat(n);
        format!("{ROADS}action a(any v: Speed in 1 m/s .. 2 m/s) {{ {spawn} }}\n")
    }),
    ("fields of a spawn", |n| {
        format!("{HEAD}action a() {{ spawn Sedan ahead 30 m {{ {} }} }}\n", each(n, |i| format!("x{i}: 1\n")))
    }),
    ("rows", |n| {
        format!("{ROADS}{COUNT}action a(each x: Int in 1 .. {n}) {{ set c = x }}\nrule r on a: x <= {n}\n")
    }),
    ("rows of a spawn", |n| {
        let spawn = "spawn Sedan ahead 50 m { lane: Current, speed: v, does: DriveAhead }";
        let drawn = "any v: Speed in 5 m/s .. 20 m/s";
        format!(
            "{ROADS}action a(each x: Int in 1 .. {n}, {drawn}) {{ {spawn} }}\nrule r on a: v <= road.limit\n"
        )
    }),
    ("rows under a rule about the moment", |n| {
        let spawn = "spawn Sedan ahead 50 m { lane: Current, speed: v, does: DriveAhead }";
        let drawn = "any v: Speed in 5 m/s .. 20 m/s";
        let rule = "rule r on a: v <= ego.speed and ego.junction_ahead >= 20 m\n";
        format!("{ROADS}action a(each x: Int in 1 .. {n}, {drawn}) {{ {spawn} }}\n{rule}")
    }),
    ("rows that a rule about the moment tells apart", |n| {
        let spawn = "spawn Sedan ahead 50 m { lane: Current, speed: v, does: DriveAhead }";
        let drawn = "any v: Speed in 5 m/s .. 20 m/s";
        let rule = "rule r on a: v <= ego.speed and ego.junction_ahead >= 20 m + x * 0.0001 m\n";
        format!("{ROADS}action a(each x: Int in 1 .. {n}, {drawn}) {{ {spawn} }}\n{rule}")
    }),
    ("rows under three rules", |n| {
        let n = n.div_ceil(2);
        let spawn = "spawn Sedan ahead d { lane: Current, speed: v, does: DriveAhead }";
        let drawn = "any v: Speed in 5 m/s .. 20 m/s, any d: Length in 1 m .. 120 m";
        let gap = "fn gap(m: Mode, v: Speed) -> Length = match m { Near => 12 m, Far => 50 m } + v * 0.5 s\n";
        let rules = "rule r on a: v <= road.limit\nrule s on a: d == gap(m, v)\nrule t on a: x * 0.001 m <= d + 60 m\n";
        format!(
            "{ROADS}enum Mode = Near | Far\n{gap}action a(each x: Int in 1 .. {n}, each m: Mode, {drawn}) {{ {spawn} }}\n{rules}"
        )
    }),
    ("keys that rows of several maps set", |n| {
        let maps = each(n.min(100), |i| {
            format!("state m{i}: E -> E = any\naction t{i}(each k: E, each x: E) {{ set m{i}[k] = x }}\n")
        });
        format!("{ROADS}{}{maps}", largest_enum())
    }),
    ("orders of one action", |n| {
        let spawn = "spawn Sedan as car ahead 50 m { lane: Current, speed: 9 m/s, does: DriveAhead }";
        let orders = "order car { speed: v, rate: 3 m/s^2 }\n".repeat(n);
        format!("{ROADS}action a() {{ {spawn} }}\naction b(any v: Speed in 1 m/s .. 9 m/s) {{ {orders} }}\n")
    }),
    ("names of road users", |n| {
        let spawn = "ahead 50 m { lane: Current, speed: 9 m/s, does: DriveAhead }";
        let actions = each(n, |i| {
            format!(
                "action a{i}() {{ spawn Sedan as n{i} {spawn} }}\naction b{i}() {{ order n{i} {{ speed: 1 m/s }} }}\nrule r{i} on b{i}: n{i}.gap <= 30 m\n"
            )
        });
        ROADS.to_owned() + &actions
    }),
    ("axes of two values", |n| {
        format!(
            "{ROADS}{BOOL}action a({}) {{ set b = true }}\n",
            listed(n, ", ", |i| format!("each p{i}: Bool"))
        )
    }),
    ("axes of one value", |n| {
        let axes = listed(n, ", ", |i| format!("each p{i}: Int in [1]"));
        format!("{ROADS}{BOOL}action a({axes}) {{ set b = true }}\n")
    }),
    ("drawn lists", |n| {
        let drawn = format!("any x: Int in 1 .. {n}, any y: Int in 1 .. {n}");
        format!("{ROADS}{COUNT}action a({drawn}) {{ set c = x + y }}\nrule r on a: x * y == 7919 * 7907\n")
    }),
    ("drawn truths that nothing fits", |n| {
        let n = n.clamp(2, 60);
        let drawn = listed(n, ", ", |i| format!("any x{i}: Bool"));
        let all = format!("{}x0{}", "(".repeat(n - 1), each(n - 1, |i| format!(" == x{})", i + 1)));
        format!(
            "{ROADS}{BOOL}action a({drawn}) {{ set b = x0 }}\nrule r on a: {all} == true\nrule s on a: {all} == false\n"
        )
    }),
    ("drawn numbers", |n| {
        let drawn = listed(n, ", ", |i| format!("any x{i}: Length in 1 m .. 9 m"));
        let rules = each(n.saturating_sub(1), |i| format!("rule r{i} on a: x{i} <= x{}\n", i + 1));
        format!("{ROADS}{BOOL}action a({drawn}) {{ set b = x0 > 2 m }}\n{rules}")
    }),
    ("groups that double", |n| {
        format!(
            "{HEAD}{BOOL}{ACTION}group g0 = a, a\n{}",
            each(n, |i| format!("group g{} = g{i}, g{i}\n", i + 1))
        )
    }),
    ("groups of all actions", |n| {
        let actions = each(n, |i| format!("action a{i}() {{ set b = false }}\n"));
        format!("{HEAD}{BOOL}{actions}{}", each(n, |i| format!("group g{i} = actions\n")))
    }),
    ("one name after `on`", |n| format!("{HEAD}{BOOL}{ACTION}rule r on a{}: b or not b\n", ", a".repeat(n))),
    ("rules on unknown actions", |n| {
        let actions = each(n, |i| format!("action a{i}() {{ set b = true }}\n"));
        format!("{HEAD}{BOOL}{actions}{}", each(n, |i| format!("rule r{i} on x{i}: b\n")))
    }),
    ("rules on all actions", |n| {
        let actions = each(n, |i| format!("action a{i}() {{ set b = true }}\n"));
        format!("{ROADS}{BOOL}{actions}{}", each(n, |i| format!("rule r{i} on actions: b or step >= {i}\n")))
    }),
    ("rules", |n| {
        let rules = each(n, |i| format!("rule r{i} on a: x <= {}\n", i + 10));
        format!("{ROADS}{COUNT}action a(each x: Int in 1 .. 10) {{ set c = x }}\n{rules}")
    }),
    ("rules that oppose one another", |n| {
        let rules = each(n, |i| format!("rule r{i} on a: ego.speed + v >= nearest.speed + {i} m/s\n"));
        format!("{ROADS}{COUNT}action a(any v: Speed in 1 m/s .. 9 m/s) {{ set c = 1 }}\n{rules}")
    }),
    ("rules about words", |n| {
        let rules = each(n, |i| format!("rule r{i} on a: ego.light in [Red, Green] or step >= {i}\n"));
        format!("{ROADS}{BOOL}{ACTION}{rules}")
    }),
    ("rules about lane changes", |n| {
        let spawn = "spawn Sedan ahead 50 m { lane: Left, speed: v, does: DriveAhead, then: Change }";
        let rules = each(n, |i| format!("rule r{i} on a during change: npc.gap >= {} m\n", i % 50));
        format!("{ROADS}action a(any v: Speed in 5 m/s .. 9 m/s) {{ {spawn} }}\n{rules}")
    }),
    ("optional rules", |n| {
        format!("{ROADS}{BOOL}{ACTION}{}", each(n, |i| format!("optional rule r{i}: b or not b\n")))
    }),
    ("transitions", |n| {
        let moves = each(n, |i| format!("V{} -> V{}\n", i % 128, (i * 7 + i / 128) % 128));
        format!(
            "{ROADS}{}state s: E = any\naction a(each e: E) {{ set s = e }}\nrule r on s {{ {moves} }}\n",
            largest_enum()
        )
    }),
    ("functions in rules", |n| {
        let calls = each(9, |i| format!("fn f{}(x: Int) -> Int = f{i}(x) + f{i}(x)\n", i + 1));
        let rules = each(n, |i| format!("rule r{i} on a: f9(x) >= {i} - 1\n"));
        let action = "action a(each x: Int in 1 .. 100) { set c = x }\n";
        format!("{ROADS}{COUNT}fn f0(x: Int) -> Int = x + x\n{calls}{action}{rules}")
    }),
    ("more effects of all actions", |n| {
        let actions = each(n, |i| format!("action a{i}() {{ set b = true }}\n"));
        format!("{ROADS}{BOOL}{actions}on actions also {{ {} }}\n", "set b = true\n".repeat(n))
    }),
    ("effects of each step", |n| {
        let states = each(n, |i| format!("state s{i}: Int = 0\n"));
        let sets = each(n, |i| format!("set s{i} = s{} + 1\n", (i + 1) % n));
        let rule = "rule r: elapsed >= 10 s implies s0 <= 300000\n";
        format!("{ROADS}{states}each step {{ {sets} }}\naction a() {{ set s0 = 0 }}\n{rule}")
    }),
    ("roads", |n| {
        let fields = "start: lane 1/-2 at 10 m, goal: lane 1/-1 at 190 m";
        let roads = each(n, |i| format!("road q{i} {{ map: \"straight.xodr\", {fields} }}\n"));
        format!("{HEAD}{roads}{COUNT}action a(each x: Int in 1 .. 100) {{ set c = x }}\n")
    }),
    ("roads of an episode", |n| {
        format!("{ROADS}{BOOL}{ACTION}episode {{ roads: [{}] }}\n", listed(n, ", ", |_| "corner".to_owned()))
    }),
    ("steps of an episode", |n| {
        let rule = "rule r: elapsed >= 1 s implies c <= 100000000\n";
        let step = "each step { set c = c + 1 }\n";
        format!("{ROADS}{COUNT}action a() {{ set c = c + 1 }}\n{step}{rule}episode {{ limit: {n} steps }}\n")
    }),
    ("cases of the reward", |n| {
        format!("{ROADS}{BOOL}{ACTION}reward {{ {}_ => 0 }}\n", each(n, |i| format!("proc > {i} % => {i}\n")))
    }),
    ("verdicts", |n| format!("{ROADS}{BOOL}{ACTION}{}", each(n, |i| format!("verdict v{i}: collision\n")))),
    ("claims", |n| {
        let action = "action a(each x: Int in 1 .. 300, each y: Int in 1 .. 100) { set c = x + y }\n";
        format!("{ROADS}{COUNT}{action}{}", "expect every(actions, realisable)\n".repeat(n))
    }),
    ("overrides", |n| ROADS.to_owned() + &each(n, |i| format!("override let a{i} = 1\n"))),
    ("steps of a scenario", |n| scenario(&each(n, |i| format!("{i}: wait()\n")), "")),
    ("conditions of a scenario", |n| {
        scenario(&each(n, |i| format!("{i}: a() once npc#{}.gap <= 30 m after 0.5 s\n", i + 1)), "")
    }),
    ("claims of a scenario", |n| scenario("0: wait()\n", &"expect end == arrived\n".repeat(n))),
    ("fields of a scenario", |n| scenario(&format!("0: a() with {{ {} }}\n", "mode: Far, ".repeat(n)), "")),
    ("lines of a policy", |n| {
        let lines = each(n, |i| format!("when dist_nearest <= {i} m => a()\n"));
        format!("{ROADS}{BOOL}{ACTION}policy p {{ rules {{ {lines} _ => a() }} }}\n")
    }),
    ("rows of a policy's line", |n| {
        format!("{ROADS}{BOOL}{ACTION}policy p {{ rules {{ _ => a(){} }} }}\n", " | a()".repeat(n))
    }),
];

fn scenario(steps: &str, claims: &str) -> String {
    format!("{ROADS}{BOOL}{ACTION}scenario s {{\nroad: corner\nsteps {{\n{steps}}}\n{claims}}}\n")
}
