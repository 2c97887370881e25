//! Conditions such as `method = mi and code = D1 and coverage < 0.1`.

use std::str::FromStr;

use super::field::{Field, Value};
use crate::localize::QueryResult;
use crate::relation::Relation;

/// A condition on a result.
///
/// `FIELD RELATION VALUE`, joined by `and`, `or`, `not` and parentheses; `and` binds more tightly than `or`.
/// Relations are those of [`Relation`]; `~` is for text only. Text is compared ignoring case, and needs quotes if
/// it contains spaces. A missing number meets no relation.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    text: String,
    tree: Tree,
}

/// Why a condition is invalid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{condition}`: {expected}")]
pub struct ConditionError {
    condition: String,
    expected: String,
}

#[derive(Clone, Debug, PartialEq)]
enum Tree {
    All(Vec<Tree>),
    Any(Vec<Tree>),
    Not(Box<Tree>),
    Number(&'static Field, Relation, f64),
    Words(&'static Field, Relation, String),
}

/// The greatest nesting depth.
const DEEPEST: usize = 64;

impl Condition {
    /// The text of the condition.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether a result meets it.
    pub fn is_met(&self, result: &QueryResult) -> bool {
        self.tree.is_met(result)
    }
}

impl Tree {
    fn is_met(&self, result: &QueryResult) -> bool {
        match self {
            Self::All(parts) => parts.iter().all(|part| part.is_met(result)),
            Self::Any(parts) => parts.iter().any(|part| part.is_met(result)),
            Self::Not(part) => !part.is_met(result),
            Self::Number(field, relation, limit) => match field.of(result) {
                Value::Number(number) => relation.holds(number, *limit),
                Value::Words(_) | Value::None => false,
            },
            Self::Words(field, relation, wanted) => {
                relation.holds_for_words(&field.text(result).to_lowercase(), wanted)
            }
        }
    }
}

impl FromStr for Condition {
    type Err = ConditionError;

    fn from_str(text: &str) -> Result<Self, ConditionError> {
        let error = |expected: String| ConditionError { condition: text.to_owned(), expected };
        let tokens = tokens(text).map_err(error)?;
        let mut parser = Parser { tokens: &tokens, depth: 0 };
        let tree = parser.any().map_err(error)?;
        match parser.tokens.first() {
            None => Ok(Self { text: text.trim().to_owned(), tree }),
            Some(token) => Err(error(format!("`and` or `or` expected before {}", token.shown()))),
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Open,
    Close,
    Relation(Relation),
    Word(String),
    Quoted(String),
}

impl Token {
    fn shown(&self) -> String {
        match self {
            Self::Open => "`(`".to_owned(),
            Self::Close => "`)`".to_owned(),
            Self::Relation(relation) => format!("`{relation}`"),
            Self::Word(word) | Self::Quoted(word) => format!("`{word}`"),
        }
    }
}

fn tokens(text: &str) -> Result<Vec<Token>, String> {
    let mut rest = text.trim_start();
    let mut tokens = Vec::new();
    while let Some(first) = rest.chars().next() {
        let (token, length) = match (first, Relation::at_start(rest)) {
            ('(', _) => (Token::Open, 1),
            (')', _) => (Token::Close, 1),
            (_, Some((relation, right))) => (Token::Relation(relation), rest.len() - right.len()),
            ('"' | '\'', _) => {
                let inside = &rest[1..];
                let end = inside.find(first).ok_or(format!("a closing {first} expected"))?;
                (Token::Quoted(inside[..end].to_owned()), end + 2)
            }
            _ => {
                let is_end = |c: char| {
                    c.is_whitespace() || "()\"'".contains(c) || Relation::STARTS.contains(c)
                };
                let end = rest.find(is_end).unwrap_or(rest.len());
                if end == 0 {
                    return Err(format!("a field, a value or a relation expected at `{rest}`"));
                }
                (Token::Word(rest[..end].to_owned()), end)
            }
        };
        tokens.push(token);
        rest = rest[length..].trim_start();
    }
    Ok(tokens)
}

struct Parser<'a> {
    tokens: &'a [Token],
    depth: usize,
}

impl Parser<'_> {
    fn next(&mut self) -> Option<&Token> {
        let (first, rest) = self.tokens.split_first()?;
        self.tokens = rest;
        Some(first)
    }

    /// Consumes a keyword if it is next.
    fn takes(&mut self, word: &str) -> bool {
        let is_next = matches!(self.tokens.first(), Some(Token::Word(next)) if next == word);
        if is_next {
            self.tokens = &self.tokens[1..];
        }
        is_next
    }

    fn any(&mut self) -> Result<Tree, String> {
        let mut parts = vec![self.all()?];
        while self.takes("or") {
            parts.push(self.all()?);
        }
        Ok(joined(parts, Tree::Any))
    }

    fn all(&mut self) -> Result<Tree, String> {
        let mut parts = vec![self.one()?];
        while self.takes("and") {
            parts.push(self.one()?);
        }
        Ok(joined(parts, Tree::All))
    }

    fn one(&mut self) -> Result<Tree, String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("at most {DEEPEST} nested parts expected"));
        }
        let tree = if self.takes("not") {
            Tree::Not(Box::new(self.one()?))
        } else if self.tokens.first() == Some(&Token::Open) {
            self.tokens = &self.tokens[1..];
            let inside = self.any()?;
            match self.next() {
                Some(Token::Close) => inside,
                _ => return Err("`)` expected".to_owned()),
            }
        } else {
            self.comparison()?
        };
        self.depth -= 1;
        Ok(tree)
    }

    fn comparison(&mut self) -> Result<Tree, String> {
        let field = match self.next() {
            Some(Token::Word(name)) => Field::find(name).map_err(|error| error.to_string())?,
            Some(other) => return Err(format!("a field expected instead of {}", other.shown())),
            None => return Err("FIELD RELATION VALUE expected, such as `error > 1`".to_owned()),
        };
        let Some(Token::Relation(relation)) = self.next().cloned() else {
            return Err(format!("a relation expected after `{}`: = != < <= > >= ~", field.name));
        };
        let value = match self.next() {
            Some(Token::Word(value) | Token::Quoted(value)) => value.clone(),
            _ => return Err(format!("a value expected for `{}`", field.name)),
        };
        if field.decimals.is_none() {
            if matches!(relation, Relation::Is | Relation::IsNot) {
                field.check(&value.to_lowercase()).map_err(|error| error.to_string())?;
            }
            return Ok(Tree::Words(field, relation, value.to_lowercase()));
        }
        let number = value.parse().ok().filter(|number: &f64| number.is_finite());
        match number {
            Some(number) if relation != Relation::Contains => {
                Ok(Tree::Number(field, relation, number))
            }
            Some(_) => Err(format!("`{}` is a number: `~` is for words", field.name)),
            None => Err(format!("`{value}`: a number expected for `{}`", field.name)),
        }
    }
}

fn joined(mut parts: Vec<Tree>, join: fn(Vec<Tree>) -> Tree) -> Tree {
    match (parts.len(), parts.pop()) {
        (1, Some(part)) => part,
        (_, last) => {
            parts.extend(last);
            join(parts)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn error(text: &str) -> String {
        let parsed: Result<Condition, _> = text.parse();
        parsed.expect_err(text).to_string()
    }

    #[test]
    fn what_is_wrong_is_named_with_what_was_expected() {
        assert!(error("").contains("such as `error > 1`"));
        assert!(error("eror > 1").contains("eror") && error("eror > 1").contains("rotation"));
        assert!(error("error 1").contains("a relation expected"));
        assert!(error("error >").contains("a value expected"));
        assert!(error("error > far").contains("a number expected"));
        assert!(error("grade = wrng").contains("right, unmeasured, wrong or no pose expected"));
        assert!(error("confidence != high").contains("trusted, unsure or low"));
        assert!(error("code = D99").contains("D99"));
        assert!(error("error ~ 1").contains("is for words"));
        assert!(error("(error > 1").contains("`)` expected"));
        assert!(error("error > 1 error < 2").contains("`and` or `or` expected before `error`"));
        assert!(error("code = 'D1").contains("a closing ' expected"));
        assert!(error(&"(".repeat(9999)).contains("nested parts"));
        assert!(error(&"not ".repeat(9999)).contains("nested parts"));
    }

    #[test]
    fn and_binds_more_tightly_than_or() {
        let tree = |text: &str| text.parse::<Condition>().expect(text).tree;
        let plain = tree("code = D1 or code = D2 and error > 1");
        assert_eq!(plain, tree("code = D1 or (code = d2 and error>1)"));
        assert_ne!(plain, tree("(code = D1 or code = D2) and error > 1"));
        assert_eq!(tree("not (error > 1)"), tree("not error > 1"));
        assert_eq!(tree("grade = 'no pose'"), tree("grade = \"No pose\""));
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in "[a-z0-9 ()<>=!~'\"é-]{0,40}") {
            let _ = text.parse::<Condition>();
        }
    }
}
