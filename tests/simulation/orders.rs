//! What operators order, how often they order it again, and what they have heard.

use apprentice::events::{Event, Quotas, Role};
use apprentice::ids::{PublicKey, TenantId};
use apprentice::tenancy::Order;

use apprentice_testkit::dice::Dice;

/// An order, and what came of it.
pub struct Given {
    pub tenant: TenantId,
    pub order: Order,
    /// None until it was obeyed or refused; then what was recorded.
    pub heard: Option<Vec<Event>>,
}

/// The labs; nobody works in the last one.
pub fn labs() -> [TenantId; 3] {
    ["bells", "chimes", "gongs"].map(|name| TenantId::new(name).unwrap())
}

/// Orders without an answer at most.
const UNDER_WAY: usize = 4;

/// The orders whose operators have heard nothing.
pub fn unanswered(given: &[Given]) -> Vec<usize> {
    (0..given.len()).filter(|&index| given[index].heard.is_none()).collect()
}

/// Thinks of something to order, unless enough is under way.
pub fn give(dice: &mut Dice, given: &mut Vec<Given>) {
    if unanswered(given).len() >= UNDER_WAY {
        return;
    }
    let tenant = dice.of(&labs()).clone();
    let is_new = given.iter().all(|it| it.tenant != tenant);
    let order = if is_new { Order::Open } else { think(dice, given, &tenant) };
    given.push(Given { tenant, order, heard: None });
}

fn think(dice: &mut Dice, given: &[Given], tenant: &TenantId) -> Order {
    let number = given.len() as u64;
    let fresh = key(number);
    let (own, others) = keys(given, tenant);
    let overlap_seconds = dice.below(2) as u64;
    let admit = |key| Order::Admit { key, role: Role::Gateway, label: format!("door {number}") };
    match dice.below(100) {
        ..5 => Order::Open,
        5..35 => admit(fresh),
        35..40 if !others.is_empty() => admit(*dice.of(&others)),
        40..55 if !own.is_empty() => Order::Retire { key: *dice.of(&own), overlap_seconds },
        55..70 if !own.is_empty() => {
            Order::Rotate { old: *dice.of(&own), new: fresh, overlap_seconds }
        }
        70..80 => Order::Disable { reason: format!("reason {number}") },
        80..90 => Order::Enable,
        _ => {
            let in_flight = Some(1_000 + number as u32);
            Order::SetQuotas(Quotas { in_flight, ..Quotas::default() })
        }
    }
}

fn key(number: u64) -> PublicKey {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&number.to_be_bytes());
    PublicKey(key)
}

/// The keys that were ordered to come in: as the tenant's, and as others'.
fn keys(given: &[Given], tenant: &TenantId) -> (Vec<PublicKey>, Vec<PublicKey>) {
    let (mut own, mut others) = (Vec::new(), Vec::new());
    for it in given {
        if let Order::Admit { key, .. } | Order::Rotate { new: key, .. } = it.order {
            if it.tenant == *tenant { own.push(key) } else { others.push(key) }
        }
    }
    (own, others)
}
