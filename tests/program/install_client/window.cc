// SPDX-License-Identifier: GPL-2.0-or-later
//
// A client with a window, written like programs for Stage 4.3. Subclasses WorldGui, runs FLTK's
// loop itself, and draws on a model.

#include <cstdio>
#include <cstring>

#include "stage.hh"

using namespace Stg;

// These names are also namespaces or folders of the library. They must not collide with them.
static int draw = 0, view = 0, window = 0, offscreen = 0;

class Node : public WorldGui {
 public:
  using WorldGui::WorldGui;
  int steps = 0;
};

class Arrow : public Visualizer {
 public:
  Arrow() : Visualizer("Arrow", "show_arrow") {}
  void Visualize(Model* mod, Camera*) override {
    mod->PushColor(Color(1, 0, 0, 1));
    Gl::draw_vector(1, 0, 0);
    glBegin(GL_POINTS);
    glVertex3f(0, 0, 1);
    glEnd();
    mod->PopColor();
    pictures++;
  }
  int pictures = 0;
};

static int Count(World*, void* node) {
  static_cast<Node*>(node)->steps++;
  return 0;
}

int main(int argc, char* argv[]) {
  Init(&argc, &argv);
  if (draw + view + window + offscreen != 0) return 1;
  if (argc > 1 && std::strcmp(argv[1], "--no-window") == 0) {
    World world;
    std::printf("windows %d\n", world.IsGUI());
    return 0;
  }
  Node* node = new Node(600, 400, "Stage (client)");
  World* world = node;
  if (static_cast<void*>(node) != static_cast<void*>(world)) return 1;
  if (!node->Load(argv[1])) return 1;
  node->AddUpdateCallback(Count, node);
  Arrow arrow;
  Model* robot = node->GetModel("wanderer");
  robot->AddVisualizer(&arrow, true);
  robot->Subscribe();
  node->Start();
  while (!node->TestQuit() && (node->steps < 5 || arrow.pictures < 2)) Fl::wait(0.05);
  std::printf("windows %d\nsteps %d\npictures %d\ntitle %s\n", world->IsGUI(), node->steps >= 5,
              arrow.pictures >= 2, node->label());
  node->Stop();
  node->World::Update();
  node->QuitAll();
  World::Run();
  delete node;
  return 0;
}
