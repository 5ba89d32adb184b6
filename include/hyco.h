/*
  hyco: hybrid hyper-reduced contact.

  Full-order and reduced models of elastic bodies in frictionless unilateral contact, after
  J. Fauque, I. Ramiere, D. Ryckelynck, Hybrid hyper-reduced modeling for contact mechanics
  problems, Int. J. Numer. Meth. Engng 115 (2018) 117-139, doi 10.1002/nme.5798 ("the paper").
  Equation numbers in the headers are those of the paper. docs/architecture.md has the table of symbols.

  Conventions, unless a docstring states otherwise:
  - Create and Load own what they return; Set references or copies; Get borrows.
  - Handles are PETSc objects. PetscObjectReference() and Destroy count references, and an object holds references to
    the objects that it uses. Destroy sets the handle to NULL. NULL and objects of another class are refused by name.
  - Every function returns a PetscErrorCode; 0 is success. Messages are one line.
  - Functions on an object are collective on the object's communicator.
  - Lengths, forces and stresses are in the consistent units of the scene.
*/
#ifndef HYCO_H
#define HYCO_H

#include <hycosys.h>
#include <hycoscene.h>
#include <hycomaterial.h>
#include <hycocontact.h>
#include <hycosamples.h>
#include <hycocone.h>
#include <hycosystem.h>
#include <hycosolver.h>
#include <hycofom.h>
#include <hycosnapshots.h>
#include <hycoreducer.h>
#include <hycorom.h>
#include <hycobindings.h>

#endif
