//! Who may ask what. The table stands in `schema/wire.md` too.

use crate::actors::{Ask, ErrorCode, Failed};
use crate::ids::TenantId;
use crate::tenancy::{Admitted, Role};

/// Who a message is from, as its door vouches: nothing in the message has a say in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Caller {
    /// Whoever reaches a door without keys: the single user of this machine, who is tenant `local`
    /// and may do everything.
    Local,
    Keyed(Admitted),
}

impl Caller {
    pub fn tenant(&self) -> TenantId {
        match self {
            Caller::Local => TenantId::local(),
            Caller::Keyed(admitted) => admitted.tenant.clone(),
        }
    }

    fn has(&self, roles: &[Role]) -> bool {
        match self {
            Caller::Local => true,
            Caller::Keyed(admitted) => roles.contains(&admitted.role),
        }
    }

    /// - errors: the role that is needed, when the caller's is another one.
    pub fn may(&self, ask: &Ask) -> Result<(), Failed> {
        let needed = roles_for(ask);
        match self {
            Caller::Keyed(admitted) if !self.has(needed) => {
                let needed: Vec<&str> = needed.iter().map(|role| role.name()).collect();
                let needed = needed.join(" or ");
                let held = admitted.role;
                let message = format!("this needs a key with the role {needed}; yours is {held}");
                Err(denied(message))
            }
            _ => Ok(()),
        }
    }
}

/// A key that was never admitted, is retired, or belongs to a tenant that is disabled. Which of
/// them is the operator's business: the sentence says the same for all.
pub(super) fn not_admitted() -> Failed {
    denied("your key is not admitted here; ask whoever runs the service".to_owned())
}

/// A connection that chose its own routing id. Answers are addressed by it, and a chosen one can be
/// taken by somebody else as soon as its owner is gone.
pub(super) fn routing_id_chosen() -> Failed {
    denied("leave the routing id of your socket unset; answers could reach another".to_owned())
}

pub(super) fn denied(message: String) -> Failed {
    Failed { code: ErrorCode::Denied, message }
}

/// People's words are for their gateway and, for help, their operator; an auditor sees sealed
/// records only, and those come from the feed.
fn roles_for(ask: &Ask) -> &'static [Role] {
    match ask {
        Ask::Hello => &[Role::Gateway, Role::Operator, Role::Auditor],
        Ask::Query(_) | Ask::Wait { .. } => &[Role::Gateway, Role::Operator],
        Ask::Command(_) => &[Role::Gateway],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::{Command, Query};

    #[test]
    fn each_role_may_ask_what_is_its_own_and_is_told_whose_the_rest_is() {
        let tenant = TenantId::new("lab").unwrap();
        let keyed = |role| Caller::Keyed(Admitted { tenant: tenant.clone(), role });
        let asks = [
            Ask::Hello,
            Ask::Query(Query::Known),
            Ask::Wait { seconds: 1 },
            Ask::Command(Command::Done),
        ];
        let allowed = |caller: Caller| asks.each_ref().map(|ask| caller.may(ask).is_ok());
        assert_eq!(allowed(Caller::Local), [true; 4]);
        assert_eq!(allowed(keyed(Role::Gateway)), [true; 4]);
        assert_eq!(allowed(keyed(Role::Operator)), [true, true, true, false]);
        assert_eq!(allowed(keyed(Role::Auditor)), [true, false, false, false]);
        let failed = keyed(Role::Auditor).may(&Ask::Query(Query::Look)).unwrap_err();
        assert_eq!(failed.code, ErrorCode::Denied);
        assert_eq!(
            failed.message,
            "this needs a key with the role gateway or operator; yours is auditor"
        );
    }
}
