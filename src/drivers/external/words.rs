//! Closed sets of words: what messages may say, and what may go wrong.

/// An enum whose values each have a name, by which they are also written down.
macro_rules! words {
    (
        $(#[$about:meta])*
        pub enum $name:ident { $($(#[$attribute:meta])* $variant:ident = $word:literal),* $(,)? }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        pub enum $name {
            $($(#[$attribute])* #[serde(rename = $word)] $variant,)*
        }

        impl $name {
            pub const ALL: [$name; [$($word),*].len()] = [$($name::$variant),*];

            pub fn name(self) -> &'static str {
                match self {
                    $($name::$variant => $word,)*
                }
            }
        }
    };
}

pub(super) use words;
