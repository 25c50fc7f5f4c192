//! The tenants' writer, its effects carried out by hand.

use std::collections::BTreeMap;

use super::*;
use crate::events::Role;
use crate::ids::{PublicKey, RequestId, Timestamp};
use crate::replay::{Through, due_segments, sign_statement};
use crate::store::conformance::{batch, stream};
use crate::store::{self, AppendError, KeyError, ReadError, Store};
use crate::tenancy::{Order, Refusal};

struct ByHand {
    store: Store,
    writer: TenantWriter<u32>,
    steps: u8,
}

type Effects = Vec<WriterEffect<u32>>;

impl ByHand {
    fn new() -> ByHand {
        let writer = TenantWriter::new(BTreeMap::new());
        ByHand { store: store::open_memory(), writer, steps: 0 }
    }

    fn hand_in(&mut self, input: WriterInput<u32>) -> Effects {
        self.steps += 1;
        let (at, fresh) = (Timestamp(u64::from(self.steps)), RequestId([self.steps; 16]));
        self.writer.step(input, Moment { at, fresh })
    }

    fn ask(&mut self, work: TenantWork) -> Effects {
        self.hand_in(WriterInput::Asked { work, caller: 7 })
    }

    fn order(&mut self, order: Order) -> Effects {
        self.ask(TenantWork::Obey { tenant: lab(), order, gone: false })
    }

    /// Carries out the one effect, an append.
    fn append(&self, mut effects: Effects) -> WriterInput<u32> {
        match effects.pop() {
            Some(WriterEffect::Append { stream, after, batch }) if effects.is_empty() => {
                WriterInput::Appended(self.store.log.append(&stream, after, batch).wait())
            }
            _ => panic!("it should append, and no more"),
        }
    }

    fn open(&mut self) {
        assert_eq!(names(&self.order(Order::Open)), ["make secret"]);
        self.store.keys.make_tenant(&lab()).unwrap();
        let effects = self.hand_in(WriterInput::SecretMade(Ok(())));
        let appended = self.append(effects);
        assert_eq!(names(&self.hand_in(appended)), ["tell doors", "publish", "answer"]);
    }
}

fn lab() -> TenantId {
    TenantId::new("lab").unwrap()
}

fn admit() -> Order {
    Order::Admit { key: PublicKey([5; 32]), role: Role::Gateway, label: "door".to_owned() }
}

fn names(effects: &[WriterEffect<u32>]) -> Vec<&'static str> {
    let name = |effect: &WriterEffect<u32>| match effect {
        WriterEffect::Append { .. } => "append",
        WriterEffect::Fold { .. } => "fold",
        WriterEffect::MakeSecret { .. } => "make secret",
        WriterEffect::ListStreams { .. } => "list streams",
        WriterEffect::FindDue { .. } => "find due",
        WriterEffect::FindEnd { .. } => "find end",
        WriterEffect::DestroyKey { .. } => "destroy key",
        WriterEffect::SignStatement { .. } => "sign",
        WriterEffect::KeepCheckpoint { .. } => "keep checkpoint",
        WriterEffect::TellDoors { .. } => "tell doors",
        WriterEffect::Publish { .. } => "publish",
        WriterEffect::Answer { .. } => "answer",
        WriterEffect::Fatal(_) => "fatal",
    };
    effects.iter().map(name).collect()
}

/// The last effect, an answer.
fn answer(mut effects: Effects) -> Result<Done, OrderError> {
    match effects.pop() {
        Some(WriterEffect::Answer { caller: 7, outcome }) => outcome,
        _ => panic!("it should answer the one who asked"),
    }
}

#[test]
fn a_refused_order_appends_nothing_and_makes_no_tenant() {
    let mut by_hand = ByHand::new();
    let effects = by_hand.order(admit());
    assert_eq!(names(&effects), ["answer"]);
    let refused = OrderError::Refused { tenant: lab(), refusal: Refusal::NotOpen };
    assert_eq!(answer(effects), Err(refused));
    assert!(by_hand.writer.is_ready() && by_hand.writer.registry(&lab()).is_none());
}

#[test]
fn the_answer_to_an_order_is_what_it_led_to_itself() {
    let (mut by_hand, tenant) = (ByHand::new(), TenantId::local());
    // The tenant of this machine is opened on the way.
    by_hand.store.keys.make_tenant(&tenant).unwrap();
    let work = TenantWork::Obey { tenant, order: Order::Enable, gone: false };
    assert_eq!(names(&by_hand.ask(work)), ["make secret"]);
    let effects = by_hand.hand_in(WriterInput::SecretMade(Ok(())));
    let opened = by_hand.append(effects);
    assert_eq!(answer(by_hand.hand_in(opened)), Ok(Done::Obeyed(vec![])));
}

#[test]
fn a_busy_log_changes_nothing_and_the_order_may_be_given_again() {
    let mut by_hand = ByHand::new();
    by_hand.open();
    assert_eq!(names(&by_hand.order(admit())), ["append"]);
    let effects = by_hand.hand_in(WriterInput::Appended(Err(AppendError::Busy { waiting: 1 })));
    assert_eq!(names(&effects), ["answer"]);
    assert!(matches!(answer(effects), Err(OrderError::Append { .. })));
    assert_eq!(names(&by_hand.order(admit())), ["append"]);
}

#[test]
fn an_order_whose_answer_was_lost_is_read_before_anybody_hears_of_it() {
    let mut by_hand = ByHand::new();
    by_hand.open();
    let effects = by_hand.order(admit());
    // It is appended, and nobody hears of that.
    by_hand.append(effects);
    let lost = WriterInput::Appended(Err(AppendError::Gone));
    assert_eq!(names(&by_hand.hand_in(lost)), ["fatal", "fold"]);
    let folded = fold(&by_hand.store, &lab());
    let effects = by_hand.hand_in(WriterInput::Folded(folded));
    assert_eq!(names(&effects), ["tell doors", "answer"]);
    assert!(matches!(answer(effects), Err(OrderError::Append { .. })));
    // Given again, it was so already.
    assert_eq!(answer(by_hand.order(admit())), Ok(Done::Obeyed(vec![])));
}

#[test]
fn a_tenant_that_could_not_be_read_again_is_read_before_the_next_order() {
    let mut by_hand = ByHand::new();
    by_hand.open();
    let effects = by_hand.order(admit());
    by_hand.append(effects);
    by_hand.hand_in(WriterInput::Appended(Err(AppendError::Gone)));
    let unreadable = || {
        let error = ReadError::Store { reason: "no light".to_owned() };
        WriterInput::Folded(Err(OrderError::Read { tenant: lab(), error }))
    };
    assert!(matches!(answer(by_hand.hand_in(unreadable())), Err(OrderError::Append { .. })));
    assert_eq!(names(&by_hand.order(admit())), ["fold"]);
    assert!(matches!(answer(by_hand.hand_in(unreadable())), Err(OrderError::Read { .. })));
    assert_eq!(names(&by_hand.order(admit())), ["fold"]);
    let folded = fold(&by_hand.store, &lab());
    let effects = by_hand.hand_in(WriterInput::Folded(folded));
    assert_eq!(names(&effects), ["tell doors", "answer"]);
    assert_eq!(answer(effects), Ok(Done::Obeyed(vec![])));
}

#[test]
fn an_erasure_destroys_the_key_and_then_says_so() {
    let mut by_hand = ByHand::new();
    let ada = stream(&by_hand.store.keys, "lab", "ada");
    by_hand.store.log.append(&ada, crate::events::Head::EMPTY, batch(["a"])).wait().unwrap();
    assert_eq!(names(&by_hand.ask(TenantWork::Erase { stream: ada.clone() })), ["find end"]);
    let end = by_hand.store.log.walk(&ada);
    assert_eq!(names(&by_hand.hand_in(WriterInput::End(end.clone()))), ["destroy key"]);
    let destroyed = by_hand.store.erase(&ada);
    assert_eq!(names(&by_hand.hand_in(WriterInput::KeyDestroyed(destroyed))), ["find end"]);
    assert_eq!(names(&by_hand.hand_in(WriterInput::End(end.clone()))), ["sign"]);
    let signed = sign_statement(&by_hand.store.keys, &lab(), b"as it is stated");
    let effects = by_hand.hand_in(WriterInput::StatementSigned(signed));
    let noted = by_hand.append(effects);
    assert_eq!(names(&by_hand.hand_in(noted)), ["tell doors", "publish", "find due"]);
    let due = due_segments(&*by_hand.store.log, &ada, crate::ids::Seq::FIRST, Through::Head);
    let effects = by_hand.hand_in(WriterInput::Due(due));
    let closed = by_hand.append(effects);
    let effects = by_hand.hand_in(closed);
    assert_eq!(names(&effects), ["tell doors", "publish", "answer"]);
    let Ok(Done::Erased(erased)) = answer(effects) else { panic!("it is an erasure") };
    assert_eq!((erased.stream, erased.head), (ada.key, end.unwrap().digest));
    assert_eq!(by_hand.writer.unfinished(vec![ada]), []);
}

#[test]
fn an_erasure_whose_key_stays_is_not_noted() {
    let mut by_hand = ByHand::new();
    let ada = stream(&by_hand.store.keys, "lab", "ada");
    by_hand.store.log.append(&ada, crate::events::Head::EMPTY, batch(["a"])).wait().unwrap();
    by_hand.ask(TenantWork::Erase { stream: ada.clone() });
    let end = by_hand.store.log.walk(&ada);
    by_hand.hand_in(WriterInput::End(end));
    let (path, reason) = ("ada.key".to_owned(), "read only".to_owned());
    let stays = WriterInput::KeyDestroyed(Err(KeyError::Io { path, reason }));
    let effects = by_hand.hand_in(stays);
    assert_eq!(names(&effects), ["answer"]);
    assert!(matches!(answer(effects), Err(OrderError::Key { .. })));
    assert_eq!(by_hand.writer.unfinished(vec![ada.clone()]), [ada]);
}

#[test]
#[should_panic(expected = "SingleWriter")]
fn two_works_at_once_are_a_defect_of_the_driver() {
    let mut by_hand = ByHand::new();
    by_hand.order(Order::Open);
    by_hand.order(Order::Open);
}
