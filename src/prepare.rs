//! What is found once for a model, so that a step need not: before the first step, and after a change of the model.

use crate::collision;
use crate::contact;
use crate::data::Data;
use crate::dynamics;
use crate::model::Model;

impl Data {
    /// Buffers for a model, and all that never changes: where what does not move is.
    ///
    /// There is room for all contacts that the scene can have, so that no step allocates after the first.
    pub fn new(model: &Model) -> Data {
        let mut data = Data::without_contacts(model);
        // A limited joint may be near both its ends.
        let joints = data.plan.dry.len() + 2 * data.plan.limited.len();
        let contacts = collision::room(model);
        data.contacts.reserve(contacts);
        data.joint_rows.reserve(joints);
        data.ties.reserve(data.plan.most_ties(model));
        let scratch = contact::Scratch::new(model, contacts, joints, &data);
        data.scratch.put(Box::new(scratch));
        data
    }

    /// The same without room for contacts: enough for dynamics without them.
    pub(crate) fn without_contacts(model: &Model) -> Data {
        let mut data = Data::blank(model);
        dynamics::prepare(model, &mut data);
        data
    }

    /// The same without room for velocities and forces: enough to see where things are and what touches.
    pub fn for_poses(model: &Model) -> Data {
        let mut data = Data::posed(model);
        dynamics::prepare_poses(model, &mut data);
        dynamics::kinematics(model, &model.qpos0, &mut data);
        data
    }

    /// Prepares everything anew if the model is another one than before, or has been changed ([`Model::edit`]).
    #[inline]
    pub fn follow(&mut self, model: &Model) {
        if self.revision != model.revision() {
            self.renew(model);
        }
    }

    #[cold]
    fn renew(&mut self, model: &Model) {
        let Data { counts, unsolved, unconverged, .. } = *self;
        *self = Data { counts, unsolved, unconverged, ..Data::new(model) };
    }
}
